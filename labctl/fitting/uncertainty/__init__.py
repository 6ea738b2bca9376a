"""Uncertainty of what a calibration gives, after the GUM (JCGM 100)."""

from labctl.fitting.uncertainty.rate import COVERAGE, RateUncertainty, rate_uncertainty
from labctl.fitting.uncertainty.use import AxisEvidence, evidence_of, use_evidence

__all__ = ["COVERAGE", "AxisEvidence", "RateUncertainty", "evidence_of", "rate_uncertainty", "use_evidence"]
