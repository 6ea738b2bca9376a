"""The figures of each page, as its answers over HTTP have them, beside the same that was recomputed.

Each row is a kind of figure: the largest difference over the size of the quantity, how many were compared, and what its
digits allow. All digits of a number are compared but where an answer, or what it is from, has fewer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from studies.page_figures_allan import bounds, freedom_of_white, interval, terms
from studies.page_figures_formulas import (
    Law,
    allan_deviation,
    bins_of_trace,
    in_bins,
    white_std,
)
from studies.page_figures_left import Left
from studies.page_figures_recomputed import (
    Sets,
    environment_of,
    law_of,
    residuals_of,
    sets_of,
    stability_of,
    steps_of,
    turning_size_of,
)
from studies.page_figures_refit import Means, Refit

#: Sums in another order.
ROUNDING = 1e-12
#: Differences of numbers 10^3 to 10^5 times as large, of which the rates of the table are stored with 12 digits.
SMALL_DIFFERENCE = 1e-7
#: A bias that is left is a hundred times smaller than the errors of which it is the mean.
OF_A_MEAN = 1e-5
#: Half a unit of the fifth digit; envelopes of readings are kept with 24 bits.
FIVE_DIGITS, SINGLE_PRECISION = 5e-5, 6e-8
#: The terms of an Allan variance are fitted in steps, which end where they change no digit of the figures shown.
OF_THE_FIT = 1e-6
#: From deg/s and s to the units of N, B and K, deg/sqrt(h), deg/h and deg/h/sqrt(h).
PER_HOUR = {"N": 60.0, "B": 3600.0, "K": 216_000.0}
ON_SHEET = {"N": "angle_random_walk", "B": "bias_instability", "K": "rate_random_walk"}
#: Columns of the trace that is compared: fewer than the readings, so that bins have several.
POINTS = 1200

Get = Callable[..., Any]


class Row(NamedTuple):
    """A kind of figure."""

    figure: str
    worst: float  #: largest difference from what was recomputed, over the largest size of the quantity
    n: int  #: how many were compared
    allowed: float


@dataclass(frozen=True)
class Compared:
    """One unit: its recording and version, what was recomputed of them, and how the answers of a page are read."""

    get: Get
    database: Path
    serial: str
    recording: int
    version: int
    sets: Sets
    law: Law
    errors: dict[str, tuple[Any, Any]]  #: axis -> measured error and residual, (n,) deg/s

    @staticmethod
    def of(get: Get, database: Path, serial: str, recording: int, version: int) -> Compared:
        """Recompute what a version leaves of a recording."""
        sets, law = sets_of(database, recording), law_of(database, serial, version)
        return Compared(get, database, serial, recording, version, sets, law, residuals_of(law, sets))

    @property
    def path(self) -> str:
        """The address of the version."""
        return f"/api/units/{self.serial}/calibrations/{self.version}"

    @property
    def residual_dps(self) -> dict[str, Any]:
        """Axis -> what the version leaves without refitting, (n,) deg/s."""
        return {axis: each[1] for axis, each in self.errors.items()}

    @cached_property
    def refit(self) -> Refit:
        """A fit of the version's law by the documentation of a fit."""
        sets, stability = self.sets, stability_of(self.database, self.recording)
        has_turning = "once_per_turn_dps" in self.get(self.path)["environment"]
        turning_var = turning_size_of(self.database, self.recording) ** 2 / 2 if has_turning else 0.0
        times = np.arange(float(len(sets.number))) if sets.t_s is None else sets.t_s
        run = np.round(sets.mean.get("run", 0.0 * sets.number))
        means = {
            axis: Means(times, run, sets.table_rate_dps, self.white_var(axis), stability, turning_var)
            for axis in self.law.axes
        }
        return Refit.of(self.law, sets, means)

    @cached_property
    def left(self) -> Left:
        """What that fit leaves of each data set."""
        return Left.of(self.refit)

    def white_var(self, axis: str) -> Any:
        """Return the variance of each mean by the white noise of its readings, (n,); None: they are not known."""
        if not self.sets.raw:
            return None
        parts = np.split(self.sets.raw[f"gyro_{axis}"], self.sets.begins[1:-1])
        return np.array([white_std(part) for part in parts]) ** 2 / self.sets.readings

    @cached_property
    def _waves_dps(self) -> dict[str, tuple[Any, Any]]:
        """Axis -> the Earth's rate that goes round with the table, (n,), and its cosine and sine by position."""
        refit = self.refit
        parts = {axis: (len(names), refit.averaged[axis][0]) for axis, names in self.law.names.items()}
        return {axis: (refit.columns[axis][:, k:] @ found[k:], found[k:]) for axis, (k, found) in parts.items()}

    @property
    def fitted_dps(self) -> dict[str, Any]:
        """Axis -> what the fit left, (n,): without the Earth's rate that goes round with the table."""
        axes, sets = self.law.axes, self.sets
        output = np.column_stack([sets.output_dps[axis] - self._waves_dps[axis][0] for axis in axes])
        left = self.law.corrected(output, sets.temperature_c) - np.column_stack([sets.own_rate_dps[a] for a in axes])
        return {axis: left[:, k] for k, axis in enumerate(axes)}

    @property
    def once_per_turn_dps(self) -> dict[str, Any]:
        """Axis -> size of the Earth's rate that goes round with the table, by position, deg/s; {}: none is fitted."""
        return {axis: np.hypot(found[0::2], found[1::2]) for axis, (_, found) in self._waves_dps.items() if len(found)}


def figure(name: str, shown: Any, own: Any, allowed: float = ROUNDING) -> Row:
    """Return the largest difference over the largest size of a quantity; unknown numbers are unknown in both."""
    first, second = (np.asarray(each, dtype=float).ravel() for each in (shown, own))
    assert first.shape == second.shape, f"{name}: {first.shape} figures are shown, {second.shape} recomputed"
    is_known = np.isfinite(second)
    assert np.array_equal(is_known, np.isfinite(first)), f"{name}: others are unknown"
    first, second = first[is_known], second[is_known]
    size = float(np.abs(second).max(initial=0.0)) or 1.0
    return Row(name, float(np.abs(first - second).max(initial=0.0)) / size, first.size, allowed)


def rms(*values: Any) -> float:
    """Return the root mean square over all values."""
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


def recording_page(c: Compared) -> Iterator[Row]:
    """Yield the figures of the page of a recording: data sets, readings, trace, Allan deviation, inspection."""
    path, sets = f"/api/recordings/{c.recording}", c.sets
    head, answer = c.get(path), c.get(f"{path}/datasets")
    yield figure("data sets, readings", [head["datasets"], head["readings"]], [len(sets.number), sets.readings.sum()])
    yield figure("number, rate and readings of data sets", [answer[name] for name in ("number", "table_rate_dps", "n")],
                 [sets.number, sets.table_rate_dps, sets.readings])  # fmt: skip
    channels = answer["channels"]
    yield figure("mean of a data set", [channels[name]["mean"] for name in channels],
                 [sets.mean[name] for name in channels])  # fmt: skip
    if not sets.raw:
        return
    yield figure("standard deviation of a data set", [channels[name]["std"] for name in channels],
                 [sets.std[name] for name in channels])  # fmt: skip
    yield figure("begin and end of a data set", [answer["t_from_s"], answer["t_until_s"]], [sets.from_s, sets.until_s])
    yield from _readings(c, path)
    yield from _allan(c, path)


def _readings(c: Compared, path: str) -> Iterator[Row]:
    """Yield single readings, the trace over all, in one data set, and the picture of the inspection."""
    sets = c.sets
    last = int(sets.number[-1])
    columns = c.get(f"{path}/samples?dataset={last}")["columns"]
    names = [
        name for name in columns if name in sets.raw and name.startswith(("t_s", "gyro_", "temperature_", "chamber_c"))
    ]
    yield figure("readings of a data set", [columns[name] for name in names],
                 [sets.raw[name][sets.begins[-2] :] for name in names])  # fmt: skip
    begin, end = sets.from_s[-1], sets.until_s[-1]
    window = f"&from_s={begin - 1}&until_s={end + 1}"
    times_s = sets.raw["t_s"]
    for words, asked, of, limits_s in (
        ("over all", "", slice(None), (sets.from_s.min(), sets.until_s.max())),
        ("within a data set", window, slice(sets.begins[-2], None), (begin - 1, end + 1)),
    ):
        bins = bins_of_trace(times_s, sets.begins, limits_s, POINTS)
        for channel in (name for name in sets.raw if name.startswith(("gyro_", "temperature_c"))):
            shown = c.get(f"{path}/trace?channel={channel}&points={POINTS}{asked}")
            yield figure("which readings share a bin", shown["n"], bins)
            own = in_bins(sets.raw[channel][of], bins)
            yield figure(f"trace {words}", [shown[name] for name in own], list(own.values()), SINGLE_PRECISION)
            times = in_bins(times_s[of], bins)["mean"]
            yield figure(f"time of a trace {words}", shown["t_s"], times, SINGLE_PRECISION)
    for course in c.get(f"{path}/inspection")["courses"]:
        drawn = [each for each in zip(course["t_s"], course["low"], course["high"], strict=True) if each[0] is not None]
        # a bin has the time of its first reading
        begins = np.searchsorted(sets.raw["t_s"], [t_s for t_s, _, _ in drawn])
        limits = [(part.min(), part.max()) for part in np.split(sets.raw[course["channel"]], begins[1:])]
        yield figure("picture of the inspection", [pair for _, *pair in drawn], limits, SINGLE_PRECISION)


def _allan(c: Compared, path: str) -> Iterator[Row]:
    """Yield the Allan deviation of the longest data set at rest, where one has enough readings."""
    sets = c.sets
    still = np.flatnonzero((np.abs(sets.table_rate_dps) < 1e-9) & (sets.readings >= 300))
    if not len(still):
        return
    k = int(still[np.argmax(sets.readings[still])])
    rows = slice(sets.begins[k], sets.begins[k + 1])
    seconds = float(np.median(np.diff(sets.raw["t_s"][rows])))
    for axis, shown in c.get(f"{path}/allan?dataset={sets.number[k]}")["axes"].items():
        readings, tau_s = sets.raw[f"gyro_{axis}"][rows], np.array(shown["tau_s"])
        own = allan_deviation(readings, seconds, shown["tau_s"])
        m = np.round(tau_s / seconds)
        yield figure("Allan deviation", shown["deviation_dps"], own, FIVE_DIGITS)
        yield figure("interval of an Allan deviation", [shown["low_dps"], shown["high_dps"]],
                     interval(own, freedom_of_white(len(readings), m)), FIVE_DIGITS)  # fmt: skip
        model, n, u = terms(own**2, tau_s, m, len(readings))
        yield figure("fitted curve of an Allan deviation", shown["model_dps"], model, FIVE_DIGITS)
        yield figure("angle random walk and its u, deg/sqrt(h)", [shown["N"]["value"], shown["N"]["u"]],
                     [60 * n, 60 * u], OF_THE_FIT)  # fmt: skip
        most = bounds(own**2, tau_s, m, len(readings))
        unseen = [name for name in most if shown[name]["value"] is None]
        yield figure("bounds of N, B and K", [shown[name]["at_most"] for name in unseen],
                     [PER_HOUR[name] * most[name] for name in unseen], SMALL_DIFFERENCE)  # fmt: skip
        sheet = {each["id"]: each for each in c.get(f"/api/units/{c.serial}/datasheet")["characteristics"]
                 if each["axis"] == axis}  # fmt: skip
        walk = sheet["angle_random_walk"]
        yield figure("data sheet: angle random walk", [walk["value"], walk["u"]], [n, u], OF_THE_FIT)
        yield figure("data sheet: bounds of N, B and K", [sheet[ON_SHEET[name]]["at_most"] for name in unseen],
                     [most[name] for name in unseen], SMALL_DIFFERENCE)  # fmt: skip


def campaign_page(c: Compared, campaign: int) -> Iterator[Row]:
    """Yield the figures of the page of a campaign: its course, its plan, and the means of its data sets."""
    course, logged = c.get(f"/api/campaigns/{campaign}/course"), environment_of(c.database, c.recording)
    yield figure("samples of the course", [course["samples"]], [len(logged["t_s"])])
    shown = [course["t_s"], course["chamber_c"], course["setpoint_c"], course["units_c"][c.serial]]
    place = np.searchsorted(logged["t_s"], course["t_s"])
    own = [logged[name][place] for name in ("t_s", "chamber_c", "chamber_setpoint_c", "temperature_c")]
    yield figure("course of a campaign", shown, own)
    timeline, steps = c.get(f"/api/campaigns/{campaign}/plan")["timeline"], steps_of(c.database, campaign)
    yield figure("begin and end of a step", [timeline[name] for name in steps], list(steps.values()))
    channel = f"gyro_{c.law.axes[0]}"
    for k, number in enumerate(c.sets.number):
        answer = c.get(f"/api/recordings/{c.recording}/datasets/{number}/mean?channel={channel}")
        own = [c.sets.mean[channel][k], c.sets.std[channel][k]]
        yield figure("channels of a campaign", [each["shown"] for each in answer["numbers"]], own)
