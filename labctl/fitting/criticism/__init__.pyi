from labctl.fitting.criticism.estimated_shapes import (
    CandidateEstimates as CandidateEstimates,
    EstimatedShape as EstimatedShape,
    candidate_estimates as candidate_estimates,
)
from labctl.fitting.criticism.criticism import (
    Criticism as Criticism,
    FittedMeans as FittedMeans,
    best_shapes as best_shapes,
    criticise as criticise,
    fit_means as fit_means,
)
from labctl.fitting.criticism.diagnostics import residual_maps as residual_maps
from labctl.fitting.criticism.effect_size import (
    SizeReference as SizeReference,
    size_for_z as size_for_z,
    size_in_noise_units as size_in_noise_units,
    size_reference as size_reference,
)
from labctl.fitting.criticism.expected_information import (
    Forecast as Forecast,
    OpenQuestion as OpenQuestion,
    forecast as forecast,
    open_question as open_question,
)
from labctl.fitting.criticism.laws.consequences import consequences as consequences
from labctl.fitting.criticism.laws.proposals import (
    Breaking as Breaking,
    Law as Law,
    breaking as breaking,
    coefficients_of_law as coefficients_of_law,
    laws_of as laws_of,
)
from labctl.fitting.criticism.laws.bends_over import bends_over as bends_over
from labctl.fitting.criticism.planned_addition import schedule_with_planned as schedule_with_planned
from labctl.fitting.criticism.reduction import (
    ReducedRecording as ReducedRecording,
    reduce_recording as reduce_recording,
)
from labctl.fitting.criticism.residuals import (
    Residuals as Residuals,
    has_one_rising_leg as has_one_rising_leg,
    where_it_fails as where_it_fails,
    worst_data_sets as worst_data_sets,
)
from labctl.fitting.criticism.suspects import MIN_CAUSE as MIN_CAUSE, Suspect as Suspect
from labctl.fitting.criticism.thermal_family import ThermalFamily as ThermalFamily, hint_of_added as hint_of_added
from labctl.fitting.criticism.verdict import Verdict as Verdict
from labctl.fitting.criticism.visibility import (
    EffectVisibility as EffectVisibility,
    Schedule as Schedule,
    effect_visibilities as effect_visibilities,
    schedule_of as schedule_of,
)
