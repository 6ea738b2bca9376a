"""Calibrations as look-up tables."""
