"""Humidity sensitivity of a gyro's bias: to be fitted, and to be hidden."""
