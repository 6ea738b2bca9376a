"""Criticism: a model compared with measurements. Lack of fit, where, suspects, and what cannot be tested.

This is the public face: other packages import from here only, never from a submodule.
"""

from labctl.fitting.criticism.criticism import (
    Criticism,
    FittedMeans,
    best_shapes,
    criticise,
    fit_means,
)
from labctl.fitting.criticism.diagnostics import residual_maps
from labctl.fitting.criticism.effect_size import SizeReference, size_for_z, size_in_noise_units, size_reference
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.criticism.residuals import (
    Residuals,
    has_one_rising_leg,
    where_it_fails,
    worst_data_sets,
)
from labctl.fitting.criticism.separation import (
    SEPARATED_CHI2,
    LeadingSignal,
    leading_signal,
    separation_chi2,
    separation_power,
)
from labctl.fitting.criticism.suspects import Suspect
from labctl.fitting.criticism.thermal_family import ThermalFamily, hint_of_added
from labctl.fitting.criticism.verdict import Verdict
from labctl.fitting.criticism.visibility import EffectVisibility, Schedule, effect_visibilities, schedule_of

__all__ = [
    "SEPARATED_CHI2",
    "Criticism",
    "EffectVisibility",
    "FittedMeans",
    "LeadingSignal",
    "ReducedRecording",
    "Residuals",
    "Schedule",
    "SizeReference",
    "Suspect",
    "ThermalFamily",
    "Verdict",
    "best_shapes",
    "criticise",
    "effect_visibilities",
    "fit_means",
    "has_one_rising_leg",
    "hint_of_added",
    "leading_signal",
    "residual_maps",
    "schedule_of",
    "separation_chi2",
    "separation_power",
    "size_for_z",
    "size_in_noise_units",
    "size_reference",
    "where_it_fails",
    "worst_data_sets",
]
