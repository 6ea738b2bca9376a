"""Calibrations: fit, revise, certify, apply."""
