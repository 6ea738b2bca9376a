from labctl.fitting.data.channels import Channels as Channels
from labctl.fitting.data.fit_data import FitData as FitData, fit_data_of as fit_data_of
from labctl.fitting.effects import CATALOGUE as CATALOGUE, describe_effects as describe_effects
from labctl.fitting.estimation.axis_solutions import fit_turning as fit_turning, residuals as residuals
from labctl.fitting.estimation.error_metrics import (
    ErrorFigures as ErrorFigures,
    ErrorSummary as ErrorSummary,
    by_turning_axis as by_turning_axis,
    rms as rms,
)
from labctl.fitting.estimation.fit import fit as fit
from labctl.fitting.estimation.held import Fixed as Fixed
from labctl.fitting.estimation.result import FitResult as FitResult, coefficients_json as coefficients_json
from labctl.fitting.models.error_model import ErrorModel as ErrorModel
from labctl.fitting.models.fitted_model import FittedModel as FittedModel
from labctl.fitting.models.held import HeldCoefficient as HeldCoefficient
from labctl.fitting.models.presets import PRESETS as PRESETS, describe_presets as describe_presets
