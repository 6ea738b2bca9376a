"""Calibrations from published tables of coefficients instead of readings."""
