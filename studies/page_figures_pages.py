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

from studies.page_figures_formulas import (
    Law,
    allan_deviation,
    asymmetry,
    in_bins,
    nonlinearity,
    straight_line,
    waves,
    without_waves,
)
from studies.page_figures_recomputed import Sets, clock_u_of, environment_of, law_of, residuals_of, sets_of, steps_of

#: Sums in another order.
ROUNDING = 1e-12
#: Differences of numbers 10^3 to 10^5 times as large, of which the rates of the table are stored with 12 digits.
SMALL_DIFFERENCE = 1e-7
#: A bias that is left is a hundred times smaller than the errors of which it is the mean.
OF_A_MEAN = 1e-5
#: Half a unit of the fifth digit; envelopes of readings are kept with 24 bits.
FIVE_DIGITS, SINGLE_PRECISION = 5e-5, 6e-8
#: The errors of the outputs of a triad are correlated, which is not written here.
BESIDE_OTHER_OUTPUTS = 1e-3
#: Columns of the trace that is compared: fewer than the readings, so that bins have several.
POINTS = 1200

#: Figures of the data sheet that a straight line through the output over the rate gives.
STRAIGHT_LINE = ("bias", "scale_factor", "scale_factor_asymmetry", "scale_factor_nonlinearity")

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
    def _left_by_fit(self) -> tuple[dict[str, Any], dict[str, Any]]:
        answer, sets, axes = self.get(self.path), self.sets, self.law.axes
        if "once_per_turn_dps" not in answer["environment"]:
            return self.residual_dps, {}
        own = np.column_stack([self.residual_dps[axis] for axis in axes])
        shown = np.full(own.shape, np.nan)
        for part in self.get(f"{self.path}/criticism")["maps"]:
            rows = np.searchsorted(sets.number, part["dataset"])
            shown[rows, axes.index(part["axis"])] = part["residual_dps"]
        each = [waves(sets.table_angle_rad, sets.turned_rad, sets.position, axis) for axis in axes]
        left, sizes = without_waves(self.law, sets.temperature_c, own, shown, each)
        return {axis: left[:, k] for k, axis in enumerate(axes)}, sizes

    @property
    def fitted_dps(self) -> dict[str, Any]:
        """Axis -> what the fit left, (n,): without the Earth's rate that goes round with the table."""
        return self._left_by_fit[0]

    @property
    def once_per_turn_dps(self) -> dict[str, Any]:
        """Axis -> size of the Earth's rate that goes round with the table, by position, deg/s; {}: none is fitted."""
        return self._left_by_fit[1]


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
    for words, asked, of in (
        ("over all", "", slice(None)),
        ("within a data set", window, slice(sets.begins[-2], None)),
    ):
        for channel in (name for name in sets.raw if name.startswith(("gyro_", "temperature_c"))):
            shown = c.get(f"{path}/trace?channel={channel}&points={POINTS}{asked}")
            own = in_bins(sets.raw[channel][of], shown["n"])
            yield figure(f"trace {words}", [shown[name] for name in own], list(own.values()), SINGLE_PRECISION)
            times = in_bins(sets.raw["t_s"][of], shown["n"])["mean"]
            yield figure(f"time of a trace {words}", shown["t_s"], times, SINGLE_PRECISION)
    for course in c.get(f"{path}/inspection")["courses"]:
        bins = [each for each in zip(course["t_s"], course["low"], course["high"], strict=True) if each[0] is not None]
        # a bin has the time of its first reading
        begins = np.searchsorted(sets.raw["t_s"], [t_s for t_s, _, _ in bins])
        limits = [(part.min(), part.max()) for part in np.split(sets.raw[course["channel"]], begins[1:])]
        yield figure("picture of the inspection", [pair for _, *pair in bins], limits, SINGLE_PRECISION)


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
        own = allan_deviation(sets.raw[f"gyro_{axis}"][rows], seconds, shown["tau_s"])
        yield figure("Allan deviation", shown["deviation_dps"], own, FIVE_DIGITS)


def unit_page(c: Compared) -> Iterator[Row]:
    """Yield the figures of the page of a unit: versions, coefficients, uncertainty in use, the error over the years."""
    answer, fitted = c.get(c.path), c.fitted_dps
    raw = rms(*(each[0] for each in c.errors.values()))
    rows = c.get(f"/api/units/{c.serial}/calibrations")
    (step,) = (each for each in c.get(f"/api/units/{c.serial}/ladder")["steps"] if each["version"] == c.version)
    (row,) = (each for each in rows if each["version"] == c.version)
    yield figure(
        "RMS error without a correction",
        [answer["error"]["raw_rms_dps"], step["raw_rms_dps"]],
        [raw, raw],
        SMALL_DIFFERENCE,
    )
    yield figure("RMS error of a version", [answer["error"]["rms_dps"], step["rms_dps"], row["rms_dps"]],
                 [rms(*fitted.values())] * 3, SMALL_DIFFERENCE)  # fmt: skip
    for axis, own in answer["axes"].items():
        names = c.law.names[axis]
        shown = [own["coefficients"][name] for name in names]
        yield figure(
            "coefficients", [each["value"] for each in shown], [c.law.coefficients[axis][name] for name in names], 0.0
        )
        yield figure("u of coefficients", [each["u"] for each in shown], np.sqrt(np.diag(c.law.covariance[axis])))
    yield from _uncertainty(c, answer["validity"])
    yield from _datasheet(c)
    yield from _trend(c)


def _uncertainty(c: Compared, validity: Any) -> Iterator[Row]:
    """Yield the contributions in use at a rate: that of the fit by its covariance, and how all are combined."""
    rate, warm = 0.5 * max(validity["rate_dps"]), float(np.mean(validity["temperature_c"]))
    answer = c.get(f"{c.path}/uncertainty?rate_dps={rate}&temperature_c={warm}")
    for axis, one in answer["axes"].items():
        own = [c.law.u_of_fit(axis, rate, warm)]
        yield figure("u of the coefficients in use", [one["coefficients_dps"]], own, BESIDE_OTHER_OUTPUTS)
        budget = answer["budget"][axis]
        first_order = [line for line in budget["lines"] if line["u"] is not None and line["sensitivity"]]
        yield figure("contributions in use", [line["contribution"] for line in first_order],
                     [abs(line["u"] * line["sensitivity"]) for line in first_order])  # fmt: skip
        if budget["combined"] is not None:
            combined = float(np.sqrt(sum(line["contribution"] ** 2 for line in budget["lines"])))
            k = answer["coverage_factor"]
            shown = [budget["combined"], budget["expanded"], k * one["combined_dps"]]
            yield figure("combined and expanded uncertainty", shown,
                         [combined, budget["k"] * combined, budget["k"] * combined])  # fmt: skip


def _datasheet(c: Compared) -> Iterator[Row]:
    """Yield the figures of the data sheet that a straight line through the output over the rate gives."""
    sets, clock_u = c.sets, clock_u_of(c.database, c.recording)
    for shown in c.get(f"/api/units/{c.serial}/datasheet")["characteristics"]:
        name, axis = shown["id"], shown["axis"]
        if shown["value"] is None or name not in STRAIGHT_LINE:
            continue
        low, high = shown["conditions"]["temperature_c"]
        rows = np.array([up[-1] == axis for up in sets.position])
        rows &= (sets.temperature_c >= low - 1e-9) & (sets.temperature_c <= high + 1e-9)
        rate, output = sets.own_rate_dps[axis][rows], sets.output_dps[axis][rows]
        (bias, slope), (u_bias, u_slope) = straight_line(output, rate)
        own = {
            "bias": [bias, u_bias],
            "scale_factor": [slope, np.hypot(u_slope, clock_u * slope)],
            "scale_factor_asymmetry": asymmetry(output, rate),
            "scale_factor_nonlinearity": [nonlinearity(output, rate, float(np.abs(rate).max()))],
        }[name]
        said = [shown["value"], shown["u"]][: len(own)]
        yield figure(f"data sheet: {name.replace('_', ' ')}", said, own, SMALL_DIFFERENCE)


def _trend(c: Compared) -> Iterator[Row]:
    """Yield the bias and scale factor that a version leaves, where the unit has a trend."""
    for point in c.get(f"/api/units/{c.serial}/trend")["points"]:
        for axis, shown in point["axes"].items():
            found, u = straight_line(c.residual_dps[axis], c.sets.own_rate_dps[axis])
            names = [(shown[k], own) for k, own in zip(("u_bias_dps", "u_scale_factor"), u, strict=True)]
            yield figure("bias left by a version", [shown["bias_dps"]], [found[0]], OF_A_MEAN)
            yield figure(
                "u of bias and scale factor left",
                [each[0] for each in names],
                [each[1] for each in names],
                SMALL_DIFFERENCE,
            )


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
