"""What the rests tell: where they are, the accelerometer by gravity, and the bias of the gyro."""
