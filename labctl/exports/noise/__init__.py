"""Noise of a gyro for estimators that correct nothing by it."""
