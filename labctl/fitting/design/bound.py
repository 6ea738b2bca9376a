"""The least hours in which any recipe could reach an uncertainty: by noise, and by heat.

By noise: the unit is measured without a break, at the points of the range that are best for the model, with its white
noise alone. The variance falls as 1 / time, so that one hour decides. The best shares of the time at each point are
found by the multiplicative algorithm (Silvey, Titterington and Torsney 1978; for a trace Torsney 1983).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.design.heat_course import STEP_S, HeatCourse
from labctl.fitting.design.noise_figures import NoiseFigures
from labctl.fitting.design.planned_sets import PlannedSets, planned_data
from labctl.fitting.design.predicted_uncertainty import K, derivative_at_points
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.estimation.axis_design import axis_design
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded

#: Rates, as shares of the largest, and temperatures between which the time is shared.
SHARES = (-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0)
LEVELS = 7
#: The same of a supply voltage, as shares of the nominal one: as far as steps of the supply go.
SUPPLY_SHARES = (0.95, 1.0, 1.05)
#: Steps of the algorithm; the criterion then changes by less than a thousandth.
STEPS = 200
HOUR_S = 3600.0
#: Time at each point, s, where only its columns count; the temperature changes behind its data set.
EACH_S = 60.0


@single_threaded
def u_of_one_hour_dps(
    positions: Sequence[str], axes: tuple[str, ...], preset: Preset, noise: NoiseFigures, use: RangeOfUse
) -> float:
    """Return U (k = 2), root mean square over the range, deg/s, of one hour without a break at the best points.

    All outputs are recorded together, so one sharing of the time has to serve them all.
    """
    sets = _every_point(positions, use)
    data = planned_data(sets, axes, noise)
    model, rows = preset.build(data)
    data = data.take(rows)
    _, weights = use.points
    parts = []
    for axis in axes:
        design = axis_design(data, model, axis)
        jacobian = derivative_at_points(model, use, design, axis)
        size = np.linalg.norm(design.columns, axis=0)
        whole = design.columns / size * np.sqrt(HOUR_S) / noise.of(axis).white_dps_rthz
        scaled = jacobian / size
        parts.append((whole, (scaled * weights[:, None]).T @ scaled))
    return K * float(np.sqrt(_least_trace(parts, data) / len(axes)))


def _least_trace(parts: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]], data: FitData) -> float:
    """Return the least sum over outputs of trace(A M^-1), with M = sum of share x x' over the points."""
    share = np.full(len(data), 1.0 / len(data))
    total = np.inf
    for _ in range(STEPS):
        gains, total = np.zeros(len(share)), 0.0
        for columns, wanted in parts:
            information = (columns * share[:, None]).T @ columns
            try:
                inverse = np.linalg.inv(information)
            except np.linalg.LinAlgError:
                raise NotEnoughData(
                    "the points of the range do not determine the coefficients of the model; choose another model"
                ) from None
            total += float(np.trace(wanted @ inverse))
            gains += np.sum((columns @ (inverse @ wanted @ inverse)) * columns, axis=1)
        share = share * np.sqrt(np.maximum(gains, 0.0))
        share /= share.sum()
    return total


def _every_point(positions: Sequence[str], use: RangeOfUse) -> PlannedSets:
    """Return a data set at each rate, temperature and voltage of a supply that the bench sets, in each position."""
    low_c, high_c = use.temperature_c
    levels = np.linspace(low_c, high_c, LEVELS)
    volts = [0.0] if use.supply_v is None else [share * use.supply_v for share in SUPPLY_SHARES]
    grid = [(p, s * use.rate_dps, t, v) for t in levels.tolist() for p in positions for s in SHARES for v in volts]
    n = len(grid)
    begin_s: Array = EACH_S * np.arange(n, dtype=np.float64)
    lasts_s = np.full(n, EACH_S - 2.0 * STEP_S)
    temperatures_c: Array = np.array([t for _, _, t, _ in grid])
    return PlannedSets(
        begin_s, lasts_s, np.array([rate for _, rate, _, _ in grid]), np.array([p for p, *_ in grid]),
        np.ones(n, dtype=np.int64), np.ones(n, dtype=np.int64), begin_s,
        HeatCourse.constant_in_steps(temperatures_c, EACH_S),
        None if use.supply_v is None else np.array([v for *_, v in grid]),
    )  # fmt: skip


def least_heat_h(
    mountings: int, temperature_c: tuple[float, float], handling_c: float | None, ramp_c_per_min: float
) -> float:
    """Return the least hours, h, in which the chamber goes through the range in each mounting and is back for the next.

    Without a temperature at which units are handled, it goes through the range once for each mounting.
    """
    low_c, high_c = temperature_c
    way_c = high_c - low_c
    if handling_c is not None:
        way_c = 2.0 * (max(high_c, handling_c) - min(low_c, handling_c))
    return mountings * way_c / ramp_c_per_min / 60.0
