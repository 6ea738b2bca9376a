"""Variance that a model leaves at each data set, by leaving out its temperature and its rate in turn.

A residual of the fit is too small by what the fit has adapted to its data set, the residual of a fit without it too
large by the error of that fit. The product of the two has the variance of the data about the model as its expectation
(for a linear fit: r'(I - H)^-1 r), for noise and for misfit alike, so neither a noise model nor a correction is needed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.errors import LabctlError
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.axis_solutions import leaning, residuals, solve_axes
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.least_squares import Solution

#: At most this many groups of rates are left out in turn.
RATE_FOLDS = 11


def left_variance(data: FitData, preset: Preset) -> dict[str, Array]:
    """Return axis -> (m,) (deg/s)^2, the variance left at each data set; NaN where it could not be left out.

    Raises NotEnoughData where the data sets do not determine the model.
    """
    model, rows = preset.build(data)
    found = solve_axes(data.take(rows), model)
    inside = residuals(FittedModel(model, found.fits), data, found.nuisance)
    data = leaning(data, found.nuisance)
    by_temperature = data.folds
    if preset.inner_only:
        by_temperature = by_temperature[1:-1]
    outside = [_left_out(data, preset, masks, found.solutions) for masks in (by_temperature, rate_folds(data))]
    left = {}
    for axis, values in inside.items():
        within = within_runs(data, values)
        products = np.stack([within * within_runs(data, without[axis]) for without in outside])
        known = np.isfinite(products)
        total = np.where(known, products, 0.0).sum(axis=0)
        left[axis] = np.where(known.any(axis=0), total / np.maximum(known.sum(axis=0), 1), np.nan)
    return left


def within_runs(data: FitData, values: Array) -> Array:
    """Return values (m,) without the mean of each powered run, where there are several: that is repeatability."""
    runs = np.asarray(data.channels["run"]) if "run" in data.channels else np.ones(len(values))
    numbers = np.unique(runs)
    if len(numbers) < 2:
        return values
    left = values.copy()
    for number in numbers:
        here = (runs == number) & np.isfinite(values)
        left[here] -= values[here].mean() if here.any() else 0.0
    return left


def rate_folds(data: FitData) -> list[NDArray[np.bool_]]:
    """Return masks (m,) of the data sets of each table rate, neighbouring ones together where there are many."""
    rates = np.round(data.channels.table_rate_dps(), 3)
    levels = np.unique(rates)
    if len(levels) < 2:
        return []
    groups = np.array_split(levels, min(len(levels), RATE_FOLDS))
    return [np.isin(rates, group) for group in groups]


def _left_out(
    data: FitData, preset: Preset, masks: list[NDArray[np.bool_]], solutions: Mapping[str, Solution]
) -> dict[str, Array]:
    """Return axis -> (m,) residuals of each data set by the fit without its fold, NaN where there is none."""
    found = {axis: np.full(len(data), np.nan) for axis in data.outputs}
    for mask in masks:
        seen = data.take(~mask)
        if mask.all():
            continue
        try:
            model, rows = preset.build(seen)
            require_enough_data(seen.take(rows), model)
            solved = solve_axes(seen.take(rows), model, solutions)
            without = residuals(FittedModel(model, solved.fits), data.take(mask), solved.nuisance)
        except LabctlError:  # too little is left, or a law that cannot be inverted: this fold says nothing
            continue
        for axis, values in without.items():
            found[axis][mask] = values
    return found
