"""Calibration of a magnetometer by turns in a constant field: hard iron, soft iron, and what they are worth."""
