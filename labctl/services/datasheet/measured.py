"""Figures of a performance sheet from the data sets of one recording, of the uncorrected outputs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.characteristics.alignment import alignment_of
from labctl.fitting.characteristics.at_rest import AXES, g_sensitivity, repeatability
from labctl.fitting.characteristics.estimate import Estimate
from labctl.fitting.characteristics.scale_factor import (
    PPM,
    StraightLine,
    asymmetry_ppm,
    changes_with_temperature,
    different_rates,
    nonlinearity_ppm,
    slope_over,
    straight_line,
)
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.mounting_angles import mountings_of
from labctl.fitting.data.temperature.levels import level_means
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty import BenchConditions, conditions_of
from labctl.fitting.uncertainty.standard_lines import Sensitivities, standards_u
from labctl.recording.positions import Position, axis_in

#: Figures at one temperature are at the level nearest to this, deg C.
USUAL_C = 25.0
#: Least number of different table rates for a straight line.
MIN_RATES = 2
PAIRS = ("xy", "xz", "yz")


@dataclass(frozen=True)
class Figure:
    """A figure of a recording: id, axis, for the g-sensitivity the axis of the force, and its data sets."""

    id: str
    axis: str
    estimate: Estimate
    rows: NDArray[np.bool_]  #: the data sets that it is computed from, (m,)
    along: str = ""


@dataclass(frozen=True)
class _Columns:
    """The data sets of a recording: temperature level, position, run and rate of each, (m,)."""

    data: FitData
    level: NDArray[np.int64]
    level_c: Array
    position: NDArray[np.str_]
    run: NDArray[np.int64]
    table_dps: Array
    bench: BenchConditions  #: the stated standards

    @property
    def usual(self) -> int:
        """The level nearest to `USUAL_C`."""
        return int(np.argmin(np.abs(self.level_c - USUAL_C)))

    def turning_about(self, axis: str) -> NDArray[np.bool_]:
        """Return which data sets turn about an axis, (m,)."""
        return np.asarray(axis_in(self.position) == axis)

    def line(self, axis: str, rows: NDArray[np.bool_]) -> StraightLine | None:
        """Return the best straight line of an output over its own true rate."""
        return self.line_about(axis, axis, rows)

    def line_about(self, axis: str, about: str, rows: NDArray[np.bool_]) -> StraightLine | None:
        """Return the line of an output over the true rate about an axis; None unless the table ran different rates.

        A line over the Earth's rate alone, which differs from position to position, is not fitted.
        """
        if different_rates(self.table_dps[rows]) < MIN_RATES:
            return None
        return straight_line(self.data.true_rate_dps(about)[rows], self.data.outputs[axis][rows])


def figures_of(data: FitData) -> list[Figure]:
    """Return all figures that the data sets of a recording give.

    Mountings that are turned about the table axis separate the angles of fixture and table in a fit. Here no angle is
    fitted, so they are left out where there are others.
    """
    straight = np.array([Position.of(each).turned_deg == 0 for each in np.asarray(data.channels["position"]).tolist()])
    straight = straight if straight.any() else ~straight
    columns = _columns(data.take(straight))
    characteristics = [each for axis in data.outputs for each in (*_of_rates(columns, axis), *_at_rest(columns, axis))]
    return [replace(each, rows=_spread(each.rows, straight)) for each in (*characteristics, *_alignment(columns))]


def _spread(rows: NDArray[np.bool_], among: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask over the data sets of another mask as a mask over all data sets, (m,)."""
    is_spread = np.zeros(len(among), dtype=bool)
    is_spread[among] = rows
    return is_spread


def _columns(data: FitData) -> _Columns:
    m = len(data)
    level = data.levels if data.levels is not None else np.zeros(m, dtype=np.int64)
    run = data.channels["run"] if "run" in data.channels else np.ones(m)
    position = np.asarray(data.channels["position"]).astype(np.str_)
    bench = conditions_of(data.info, {}, mountings=mountings_of(data.channels))
    return _Columns(
        data, level, np.asarray(level_means(data.temperature_c, level)), position, np.asarray(run, dtype=np.int64),
        data.channels.table_rate_dps(), replace(bench, separates=False),
    )  # fmt: skip


def _of_rates(seen: _Columns, axis: str) -> Iterator[Figure]:
    """Yield the figures by rates about an axis: at the usual temperature, over temperature, and from run to run."""
    about_axis = seen.turning_about(axis)
    at_usual_level = about_axis & (seen.level == seen.usual)
    line = seen.line(axis, at_usual_level)
    if line is None:
        return
    standards = standards_u(seen.bench, Sensitivities.of_one(relative_rate=line.scale_factor.value))
    yield Figure("scale_factor", axis, _with(line.scale_factor, standards), at_usual_level)
    yield Figure("bias", axis, line.bias_dps, at_usual_level)
    rate = seen.data.true_rate_dps(axis)[at_usual_level]
    if different_rates(seen.table_dps[at_usual_level]) > MIN_RATES:
        white = seen.data.white_var
        u = None if white is None else np.sqrt(white[axis][at_usual_level])
        yield Figure(
            "scale_factor_nonlinearity", axis, nonlinearity_ppm(line, float(np.max(np.abs(rate))), u), at_usual_level
        )
    if (value := asymmetry_ppm(rate, seen.data.outputs[axis][at_usual_level])) is not None:
        yield Figure("scale_factor_asymmetry", axis, value, at_usual_level)
    yield from _over_temperature(seen, axis, about_axis, line.scale_factor.value)
    yield from _from_run_to_run(seen, axis, about_axis, line.scale_factor.value)


def _over_temperature(
    seen: _Columns, axis: str, about_axis: NDArray[np.bool_], scale_factor: float
) -> Iterator[Figure]:
    lines = {
        level: line
        for level in range(len(seen.level_c))
        if (line := seen.line(axis, about_axis & (seen.level == level))) is not None
    }
    if len(lines) > 1:
        temperature_c = seen.level_c[list(lines)]
        bias = slope_over(temperature_c, [line.bias_dps for line in lines.values()])
        scale = slope_over(temperature_c, [line.scale_factor for line in lines.values()])
    else:  # temperatures without levels, or levels without rates enough for a line each
        rate, warm_c = seen.data.true_rate_dps(axis)[about_axis], seen.data.temperature_c[about_axis]
        changes = changes_with_temperature(rate, warm_c, seen.data.outputs[axis][about_axis])
        bias, scale = changes or (None, None)
    if bias is not None:
        yield Figure("bias_temperature", axis, bias, about_axis)
    if scale is not None:
        yield Figure("scale_factor_temperature", axis, _times(scale, PPM / scale_factor), about_axis)


def _from_run_to_run(seen: _Columns, axis: str, about_axis: NDArray[np.bool_], scale_factor: float) -> Iterator[Figure]:
    biases, scales = [], []
    for level in range(len(seen.level_c)):
        for position in np.unique(seen.position[about_axis]):
            rows = about_axis & (seen.level == level) & (seen.position == position)
            lines = {
                int(run): line
                for run in np.unique(seen.run[rows])
                if (line := seen.line(axis, rows & (seen.run == run))) is not None
            }
            biases.append({run: line.bias_dps.value for run, line in lines.items()})
            scales.append({run: line.scale_factor.value for run, line in lines.items()})
    if (value := repeatability(biases)) is not None:
        yield Figure("bias_repeatability", axis, value[0], about_axis)
    if (value := repeatability(scales)) is not None:
        yield Figure("scale_factor_repeatability", axis, _times(value[0], PPM / scale_factor), about_axis)


def _at_rest(seen: _Columns, axis: str) -> Iterator[Figure]:
    """Yield the figures at rest: bias and its repeatability where no rate was run, and the g-sensitivity."""
    still = seen.table_dps == 0
    error = seen.data.outputs[axis] - seen.data.true_rate_dps(axis)
    if not np.any(seen.table_dps):
        yield from _bias_at_rest(seen, axis, error)
    fullest = max(
        range(len(seen.level_c)), key=lambda each: len(np.unique(seen.position[still & (seen.level == each)]))
    )
    rows = still & (seen.level == fullest)
    if (value := g_sensitivity(seen.position[rows], error[rows])) is not None:
        for along, estimate in zip(AXES, value, strict=True):
            yield Figure("g_sensitivity", axis, estimate, rows, along)


def _bias_at_rest(seen: _Columns, axis: str, error: Array) -> Iterator[Figure]:
    rows = seen.level == seen.usual
    n = int(np.count_nonzero(rows))
    u = float(np.std(error[rows], ddof=1) / np.sqrt(n)) if n > 1 else None
    yield Figure("bias", axis, Estimate(float(np.mean(error[rows])), u), rows)
    groups = []
    for level in range(len(seen.level_c)):
        for position in np.unique(seen.position):
            at = (seen.level == level) & (seen.position == position)
            runs = np.unique(seen.run[at])
            groups.append({int(run): float(np.mean(error[at & (seen.run == run)])) for run in runs})
    if (value := repeatability(groups)) is not None:
        yield Figure("bias_repeatability", axis, value[0], np.ones(len(error), dtype=bool))


def _alignment(seen: _Columns) -> Iterator[Figure]:
    """Yield misalignment and orthogonality from the slopes of all outputs over the rate about each axis."""
    if set(seen.data.outputs) != set(AXES):
        return
    k, u, has_u = np.eye(3), np.zeros((3, 3)), True
    used = np.zeros(len(seen.data), dtype=bool)
    for j, about in enumerate(AXES):
        rows = seen.turning_about(about) & (seen.level == seen.usual)
        used |= rows
        leaning = standards_u(seen.bench, Sensitivities.of_one(angle=1.0, gains=seen.bench.angle_gains(about)))
        for i, axis in enumerate(AXES):
            line = seen.line_about(axis, about, rows)
            if line is None:
                return
            k[i, j] = line.scale_factor.value
            has_u &= line.scale_factor.u is not None
            u[i, j] = math.hypot(line.scale_factor.u or 0.0, 0.0 if i == j else leaning)
    try:
        alignment = alignment_of(k, u if has_u else None)
    except ValueError:  # the sign of an axis is reversed, which no rotation does
        return
    for axis, estimate in zip(AXES, alignment.misalignment_deg, strict=True):
        yield Figure("misalignment", axis, estimate, used)
    for pair, estimate in zip(PAIRS, alignment.orthogonality_deg, strict=True):
        yield Figure("orthogonality", pair, estimate, used)


def _with(estimate: Estimate, u: float) -> Estimate:
    """Return an estimate with a further contribution to its standard uncertainty."""
    return Estimate(estimate.value, None if estimate.u is None else math.hypot(estimate.u, u))


def _times(estimate: Estimate, factor: float) -> Estimate:
    return Estimate(estimate.value * factor, None if estimate.u is None else estimate.u * abs(factor))
