"""Uncertainty of a corrected rate in use, on later days: coefficients, error of the model there, and repeatability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.estimation.held.resolution import Fixed, with_held
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset, preset_for
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.json_numbers import plain_list
from labctl.fitting.uncertainty.cross_validation import left_variance
from labctl.fitting.uncertainty.local_model_error import LocalModelError
from labctl.fitting.uncertainty.repeatability import Repeatability, repeatability_of
from labctl.json_types.calibrations import AxisEvidenceJson
from labctl.recording import Recording


@dataclass(frozen=True)
class AxisEvidence:
    """What a recording shows of one axis' errors beside those of the coefficients."""

    model_error: LocalModelError
    repeatability: Repeatability | None  #: None where nothing tells how far a later power-on is off

    def to_json(self) -> AxisEvidenceJson:
        """Return this as JSON, the variances in (deg/s)^2."""
        local = self.model_error
        return {
            "rate_dps": local.rate_dps.tolist(),
            "temperature_c": local.temperature_c.tolist(),
            "left_var": plain_list(local.left_var),
            "white_var": local.white_var.tolist(),
            "repeatability_dps": self.repeatability.u_dps if self.repeatability else None,
            "repeatability_freedom": self.repeatability.freedom if self.repeatability else None,
            "repeatability_source": self.repeatability.source if self.repeatability else "none",
        }

    @staticmethod
    def from_json(record: AxisEvidenceJson) -> AxisEvidence:
        """Return what `to_json` described."""
        columns = (record["rate_dps"], record["temperature_c"], record["left_var"], record["white_var"])
        local = LocalModelError(*(np.asarray(column, dtype=np.float64) for column in columns))
        u_dps = record["repeatability_dps"]
        if u_dps is None:
            return AxisEvidence(local, None)
        return AxisEvidence(
            local, Repeatability(u_dps, record["repeatability_source"], record["repeatability_freedom"])
        )


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
    return {
        axis: AxisEvidence(
            LocalModelError(
                data.true_rate_dps(axis),
                data.channels.temperature_c(axis),
                left[axis],
                data.white_var[axis] if data.white_var is not None else np.zeros(len(data)),
            ).thinned(),
            repeatability[axis],
        )
        for axis in data.outputs
    }


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
