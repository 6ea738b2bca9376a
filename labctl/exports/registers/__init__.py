"""Registers of equipment that a calibration is entered in."""
