"""Uncertainty of what a calibration gives, after the GUM (JCGM 100)."""

from labctl.fitting.uncertainty.rate import COVERAGE, RateUncertainty, rate_uncertainty

__all__ = ["COVERAGE", "RateUncertainty", "rate_uncertainty"]
