"""Formats of an accelerometer's or a magnetometer's calibration: reading -> matrix (reading - offset)."""
