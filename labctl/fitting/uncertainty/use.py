"""Uncertainty of a corrected rate in use, on later days: coefficients, error of the model there, and repeatability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.estimation.held.resolution import Fixed, with_held
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset, preset_for
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.json_numbers import plain_list
from labctl.fitting.uncertainty.cross_validation import left_variance, within_runs
from labctl.fitting.uncertainty.local_model_error import LocalModelError
from labctl.fitting.uncertainty.repeatability import Repeatability, repeatability_of
from labctl.json_types.calibrations import AxisEvidenceJson
from labctl.recording import Recording

#: Of a calibration that an earlier version of labctl has made.
HALVED = "an earlier version of labctl took half the figure of the data sheet, whatever its convention: fit it again"


@dataclass(frozen=True)
class AxisEvidence:
    """What a recording shows of one axis' errors beside those of the coefficients."""

    model_error: LocalModelError
    repeatability: Repeatability | None  #: None where nothing tells how far a later power-on is off
    correlation: Mapping[str, float] = field(default_factory=dict)  #: of its residuals with those of other outputs

    def to_json(self) -> AxisEvidenceJson:
        """Return this as JSON, the variances in (deg/s)^2."""
        local = self.model_error
        found: AxisEvidenceJson = {
            "rate_dps": local.rate_dps.tolist(),
            "temperature_c": local.temperature_c.tolist(),
            "left_var": plain_list(local.left_var),
            "white_var": local.white_var.tolist(),
            "repeatability_dps": self.repeatability.u_dps if self.repeatability else None,
            "repeatability_freedom": self.repeatability.freedom if self.repeatability else None,
            "repeatability_source": self.repeatability.source if self.repeatability else "none",
        }
        if self.repeatability and self.repeatability.convention:
            found["repeatability_convention"] = self.repeatability.convention
            found["repeatability_text"] = self.repeatability.text
        if local.across_dps is not None:
            found["across_dps"] = {axis: rates.tolist() for axis, rates in local.across_dps.items()}
        if self.correlation:
            found["correlation"] = dict(self.correlation)
        return found

    @staticmethod
    def from_json(record: AxisEvidenceJson) -> AxisEvidence:
        """Return what `to_json` described."""
        columns = (record["rate_dps"], record["temperature_c"], record["left_var"], record["white_var"])
        rate, warm, left, white = (np.asarray(column, dtype=np.float64) for column in columns)
        kept = record.get("across_dps")
        across = None if kept is None else {axis: np.asarray(each, dtype=np.float64) for axis, each in kept.items()}
        local = LocalModelError(rate, warm, left, white, across)
        u_dps, correlation = record["repeatability_dps"], record.get("correlation", {})
        if u_dps is None:
            return AxisEvidence(local, None, correlation)
        source = record["repeatability_source"]
        text = record.get("repeatability_text", HALVED if source == "data sheet" else "")
        convention = record.get("repeatability_convention")
        known = Repeatability(u_dps, source, record["repeatability_freedom"], text, convention)
        return AxisEvidence(local, known, correlation)


@single_threaded
def use_evidence(
    data: FitData, preset: Preset, instability_dps: Mapping[str, float | None] | None = None
) -> dict[str, AxisEvidence]:
    """Return axis -> what a recording shows of a model's errors in use.

    `instability_dps` is each axis' bias instability by a static record. Raises NotEnoughData where the data sets do not
    determine the model.
    """
    model, rows = preset.build(data)
    found = solve_axes(data.take(rows), model)
    left = left_variance(data, preset)
    inside = residuals(FittedModel(model, found.fits), data, found.nuisance)
    repeatability = repeatability_of(data, inside, instability_dps or {})
    correlation = _correlation({axis: within_runs(data, values) for axis, values in inside.items()})
    return {
        axis: AxisEvidence(
            LocalModelError(
                data.true_rate_dps(axis),
                data.channels.temperature_c(axis),
                left[axis],
                data.white_var[axis] if data.white_var is not None else np.zeros(len(data)),
                _turned_across(data, axis),
            ).thinned(),
            repeatability[axis],
            correlation[axis],
        )
        for axis in data.outputs
    }


def _turned_across(data: FitData, axis: str) -> dict[str, Array]:
    """Return the rates about the body axes beside one, those about which the table turned the unit."""
    turned = {name for name in BODY_AXES if np.any(data.channels.up(name) * data.channels.table_rate_dps())}
    return {name: data.true_rate_dps(name) for name in BODY_AXES if name in turned - {axis}}


def _correlation(residual_dps: Mapping[str, Array]) -> dict[str, dict[str, float]]:
    """Return axis -> other axis -> correlation coefficient of their residuals, where both scatter."""
    found: dict[str, dict[str, float]] = {axis: {} for axis in residual_dps}
    for one, other in permutations(residual_dps, 2):
        known = np.isfinite(residual_dps[one]) & np.isfinite(residual_dps[other])
        pair = np.array([residual_dps[one][known], residual_dps[other][known]])
        if np.all(np.ptp(pair, axis=1) > 0):
            found[one][other] = float(np.atleast_2d(np.corrcoef(pair))[0, 1])
    return found


def evidence_of(
    recording: Recording, model: str | None, effects: list[str] | None, fixed: Fixed | None = None
) -> dict[str, AxisEvidence]:
    """Return what a recording shows of a model's errors in use, by axis.

    Nothing for a table of coefficients, and in poses, where no error at a single rate is seen.

    Raises what `fit` raises.
    """
    if recording.info.kind == "coefficients" or recording.info.motion == "poses":
        return {}
    data = fit_data_of(recording)
    return use_evidence(data, with_shapes(data, with_held(data, preset_for(model, effects or []), fixed)))
