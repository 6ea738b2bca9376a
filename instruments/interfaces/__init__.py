"""Interfaces of the instruments: table, chamber, gyro, unit handler. Names carry their units."""
