"""Errors of a tri-axial unit before and after compensation, at data that no fit has seen where that is possible."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import LabctlError, NotEnoughData
from labctl.fitting import FitData, FitResult, FittedModel, fit, fit_turning
from labctl.fitting.data.temperature.levels import level_means
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.models.presets import preset_for
from labctl.fitting.numeric.arrays import Array
from labctl.services.reproduction.sources import Measured

#: The paper prints K, B and Tables 3 and 4 at this temperature.
SHOWN_C = 25.0


@dataclass(frozen=True)
class Judged:
    """Errors of the data sets (m,) by output axis, deg/s: NaN where a method was not applied to a data set."""

    name: str
    data: FitData
    raw: Mapping[str, Array]
    traditional: Mapping[str, Array]
    proposed: Mapping[str, Array]
    proposed_model: FittedModel
    traditional_model: FittedModel | None
    how: str  #: which data the errors are of


def raw_errors(data: FitData) -> dict[str, Array]:
    """Return output less true rate, axis -> (m,) deg/s."""
    return {axis: data.outputs[axis] - data.true_rate_dps(axis) for axis in data.outputs}


def left_out_errors(measured: Measured, data: FitData, result: FitResult) -> Judged:
    """Return the errors at each temperature by a fit without it; where that is impossible, those of the whole fit."""
    traditional = None
    with suppress(LabctlError):  # said by the numbers that are missing
        traditional = fit(measured.recording, "single_temperature")
    proposed = {axis: np.full(len(data), np.nan) for axis in data.outputs}
    preset, pairs, masks = preset_for("yang2018", []), data.without_each_temperature, data.folds
    try:
        for (seen, left), mask in list(zip(pairs, masks, strict=True))[1:-1]:
            model, _ = preset.build(seen)
            solved = solve_axes(seen, model)
            for axis, values in residuals(FittedModel(model, solved.fits), left, solved.nuisance).items():
                proposed[axis][mask] = values
        how = "each inner temperature by a fit without it; the outer ones cannot be interpolated"
    except NotEnoughData:
        proposed, how = (
            dict(result.residual_dps),
            "the data of the fit, since there are too few temperatures to leave out",
        )
    left_by_one = {axis: np.full(len(data), np.nan) for axis in data.outputs}
    if traditional is not None:
        left_by_one = residuals(traditional.fitted, data, fit_turning(traditional.fitted, data))
    return Judged(
        measured.name, data, raw_errors(data), left_by_one, proposed, result.fitted,
        None if traditional is None else traditional.fitted, how,
    )  # fmt: skip


def at_shown(data: FitData) -> tuple[NDArray[np.bool_], float]:
    """Return the data sets of the level nearest to 25 deg C, mask (m,), and their mean temperature, deg C."""
    levels = data.levels
    if levels is None:
        return np.ones(len(data), dtype=bool), float(data.temperature_c.mean())
    means = level_means(data.temperature_c, levels)
    nearest = int(np.argmin(np.abs(means - SHOWN_C)))
    return levels == nearest, float(means[nearest])
