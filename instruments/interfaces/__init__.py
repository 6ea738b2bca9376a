"""What each kind of instrument can do: table, chamber, gyro, unit handler. Units in every name."""
