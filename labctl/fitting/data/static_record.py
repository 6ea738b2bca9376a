"""The static record in a recording: the longest section at rest, at one temperature, without a gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.answers.noise import AllanJson, NoiseFigure, StaticRecordJson
from labctl.fitting.numeric.allan import MIN_READINGS, Allan, Figure, allan
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import plain, plain_list
from labctl.recording import Recording
from labctl.recording.recording import Columns, temperature_of

#: A temperature that stays within this counts as one.
ONE_TEMPERATURE_K = 1.0
#: Readings further apart than this many of their usual spacings have a gap between them.
GAP = 1.5
#: From this length on a static record knows the drift better than a data sheet does.
LONG_S = 1200.0
#: A stretch is divided into this many pieces, whose mean temperatures are compared.
PIECES = 2000


@dataclass(frozen=True)
class StaticRecord:
    """One stretch at rest: where, at which temperature, and the noise of each axis."""

    first_dataset: int
    last_dataset: int
    temperature_c: float
    duration_s: float
    axes: Mapping[str, Allan]

    def instability_dps(self, axis: str) -> float | None:
        """Return the bias instability of an axis, deg/s; None where the record is too short for it, or hides it."""
        if self.duration_s < LONG_S or axis not in self.axes:
            return None
        return self.axes[axis].instability_dps

    def to_json(self) -> StaticRecordJson:
        """Return this as JSON: where it is, and the deviation and the figures by axis."""
        return {
            "datasets": [self.first_dataset, self.last_dataset],
            "temperature_c": plain(self.temperature_c),
            "duration_s": plain(self.duration_s),
            "axes": {
                axis: _axis_json(noise, self.instability_dps(axis) is not None) for axis, noise in self.axes.items()
            },
        }


def _axis_json(noise: Allan, is_prior: bool) -> AllanJson:
    axis_json: AllanJson = {
        "tau_s": plain_list(noise.tau_s),
        "deviation_dps": plain_list(noise.deviation_dps),
        "low_dps": plain_list(noise.low_dps),
        "high_dps": plain_list(noise.high_dps),
        "model_dps": plain_list(noise.model_dps),
        "N": _figure_json(noise.figures["N"]),
        "B": _figure_json(noise.figures["B"]),
        "K": _figure_json(noise.figures["K"]),
        "trend_dps": plain(noise.trend_dps),
        "replaces_datasheet": is_prior,
    }
    if noise.from_s > noise.tau_s[0]:
        axis_json["from_s"] = noise.from_s
    if noise.smoothing_s > 0:
        axis_json["smoothing_s"] = noise.smoothing_s
    if noise.step_dps is not None:
        axis_json["step_dps"] = noise.step_dps
    return axis_json


def _figure_json(figure: Figure) -> NoiseFigure:
    return {
        "value": figure.value, "u": figure.u, "unit": figure.unit, "at_most": figure.at_most, "why": figure.why,
    }  # fmt: skip


def static_record(recording: Recording, least_s: float = 0.0) -> StaticRecord | None:
    """Return the longest static stretch of a recording's readings with its noise; None where it is below `least_s`."""
    rows = longest_stretch(recording)
    if rows is None:
        return None
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64)[rows]
    period_s = float((t_s[-1] - t_s[0]) / (len(t_s) - 1))
    if len(t_s) * period_s < least_s:
        return None
    axes = {str(axis): allan(recording.gyro_dps(axis)[rows], period_s) for axis in recording.info.axes}
    noise_by_axis = {axis: noise for axis, noise in axes.items() if noise is not None}
    if not noise_by_axis:
        return None
    dataset = np.asarray(recording.columns["dataset"])[rows]
    temperature_c = temperature_of(recording.columns)
    mean_c = float(temperature_c[rows].mean()) if temperature_c is not None else np.nan
    return StaticRecord(int(dataset[0]), int(dataset[-1]), mean_c, float(len(t_s) * period_s), noise_by_axis)


def longest_stretch(recording: Recording) -> slice | None:
    """Return the rows of the longest static stretch; None where none has readings enough."""
    if recording.info.kind != "samples":
        return None
    return stretch_of(recording.columns)


def stretch_of(columns: Columns) -> slice | None:
    """Return the rows of the longest static stretch of columns with `t_s`; at rest all along where no rate is given."""
    if "t_s" not in columns or len(columns["t_s"]) < MIN_READINGS:
        return None
    t_s = np.asarray(columns["t_s"], dtype=np.float64)
    steps = np.diff(t_s)
    spacing = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    together = (steps > 0) & (steps < GAP * spacing)
    for name in ("run", "mounting", "position"):
        if name in columns:
            values = np.asarray(columns[name])
            together &= values[1:] == values[:-1]
    is_at_rest = np.asarray(columns.get("table_rate_dps", np.zeros(len(t_s))), dtype=np.float64) == 0
    if "valid" in columns:
        is_at_rest &= np.asarray(columns["valid"]) != 0
    begins = np.flatnonzero(is_at_rest & np.concatenate([[True], ~(together & is_at_rest[:-1])]))
    ends = np.flatnonzero(is_at_rest & np.concatenate([~(together & is_at_rest[1:]), [True]])) + 1
    temperature_c = temperature_of(columns)
    if temperature_c is None:  # the noise does not depend on a known temperature
        temperature_c = np.zeros(len(t_s))
    best = slice(0, 0)
    for begin, end in sorted(zip(begins, ends, strict=True), key=lambda pair: pair[0] - pair[1]):
        if end - begin <= best.stop - best.start:
            break
        first, last = _steady(temperature_c[begin:end])
        if last - first > best.stop - best.start:
            best = slice(int(begin + first), int(begin + last))
    return best if best.stop - best.start >= MIN_READINGS else None


def _steady(temperature_c: Array) -> tuple[int, int]:
    """Return the longest part, from and until, of temperatures (n,) that stays at one."""
    size = max(len(temperature_c) // PIECES, 1)
    starts = np.arange(0, len(temperature_c), size)
    means: NDArray[np.float64] = np.add.reduceat(temperature_c, starts) / np.diff(np.append(starts, len(temperature_c)))
    best, begin = (0, 0), 0
    low: list[int] = []  # pieces of the window whose temperatures rise, so that the lowest is the first; and fall
    high: list[int] = []
    for end, now in enumerate(means.tolist()):
        while low and means[low[-1]] >= now:
            low.pop()
        while high and means[high[-1]] <= now:
            high.pop()
        low.append(end)
        high.append(end)
        while means[high[0]] - means[low[0]] > ONE_TEMPERATURE_K:
            begin = min(low[0], high[0]) + 1
            if low[0] < begin:
                low.pop(0)
            if high[0] < begin:
                high.pop(0)
        if end + 1 - begin > best[1] - best[0]:
            best = (begin, end + 1)
    return best[0] * size, min(best[1] * size, len(temperature_c))
