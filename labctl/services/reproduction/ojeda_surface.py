"""The error surface of one axis: the data sets that turned it, and what the paper's fit leaves of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.error_per_turn import bias_at_rest, turn_errors
from labctl.errors import BadInput
from labctl.fitting import FitResult, fit, fit_data_of
from labctl.fitting.numeric.arrays import Array
from labctl.services.reproduction.sources import Measured


@dataclass(frozen=True)
class Surface:
    """The data sets of one axis that was turned, (m,) each, and what the fit leaves of them."""

    name: str
    axis: str
    result: FitResult
    rate_dps: Array
    output_dps: Array
    temperature_c: Array
    raw_dps: Array
    left_dps: Array
    turn_before_deg: Array  #: NaN below 5 deg/s
    turn_after_deg: Array


def surface_of(measured: Measured, axis: str) -> Surface:
    """Fit the paper's model, and return what it leaves of the data sets that turned the axis. Raises LabctlError."""
    data = fit_data_of(measured.recording)
    result = fit(measured.recording, "ojeda2000")
    about_axis = np.char.lstrip(np.asarray(data.channels["position"]).astype(np.str_), "-") == axis
    if not np.any(about_axis):
        raise BadInput(f"the recording never turns axis {axis}; name another axis with --axis")
    rate, temperature_c = data.true_rate_dps(axis)[about_axis], data.channels.temperature_c(axis)[about_axis]
    table = data.channels.table_rate_dps()[about_axis]
    position = np.asarray(data.channels["position"]).astype(np.str_)[about_axis]
    raw, residual = data.outputs[axis][about_axis] - rate, result.residual_dps[axis][about_axis]
    before, after = (
        np.array(turn_errors(error - bias_at_rest(error, table, temperature_c, position), table), dtype=np.float64)
        for error in (raw, residual)
    )
    return Surface(
        measured.name, axis, result, rate, data.outputs[axis][about_axis], temperature_c, raw, residual, before, after
    )
