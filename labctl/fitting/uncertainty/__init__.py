"""Uncertainty of what a calibration gives, after the GUM (JCGM 100)."""

from labctl.fitting.uncertainty.budget import Budget, BudgetLine
from labctl.fitting.uncertainty.coefficient_budget import coefficient_budgets, response_budgets
from labctl.fitting.uncertainty.conditions import BenchConditions, conditions_of
from labctl.fitting.uncertainty.rate import COVERAGE, RateUncertainty, of_budget, rate_uncertainty
from labctl.fitting.uncertainty.rate_vector import RateVectorUncertainty, rate_vector_uncertainty
from labctl.fitting.uncertainty.use import AxisEvidence, evidence_of, use_evidence

__all__ = [
    "COVERAGE",
    "AxisEvidence",
    "BenchConditions",
    "Budget",
    "BudgetLine",
    "RateUncertainty",
    "RateVectorUncertainty",
    "coefficient_budgets",
    "conditions_of",
    "evidence_of",
    "of_budget",
    "rate_uncertainty",
    "rate_vector_uncertainty",
    "response_budgets",
    "use_evidence",
]
