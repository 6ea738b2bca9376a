"""Calibrations in whole numbers, for processors without floating point."""
