"""Numbers only: a recording in, a model out. No database, no HTTP, no clock."""

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.effects import CATALOGUE, describe_effects
from labctl.fitting.estimation.axis_solutions import fit_turning, residuals
from labctl.fitting.estimation.error_metrics import ErrorFigures, Spread, by_turning_axis, rms
from labctl.fitting.estimation.fit import fit
from labctl.fitting.estimation.held.resolution import Fixed
from labctl.fitting.estimation.result import FitResult, coefficients_json
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.held import HeldCoefficient
from labctl.fitting.models.presets import PRESETS, describe_presets

__all__ = [
    "CATALOGUE",
    "PRESETS",
    "Channels",
    "ErrorFigures",
    "ErrorModel",
    "FitData",
    "FitResult",
    "FittedModel",
    "Fixed",
    "HeldCoefficient",
    "Spread",
    "by_turning_axis",
    "coefficients_json",
    "describe_effects",
    "describe_presets",
    "fit",
    "fit_data_of",
    "fit_turning",
    "residuals",
    "rms",
]
