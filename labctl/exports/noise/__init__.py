"""Formats that give an estimator the noise of a gyro, and no correction."""
