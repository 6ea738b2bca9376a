"""Trend of a unit: its versions applied as they are to its recordings, and the drift of what one of them leaves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from labctl.answers.units import AppliedVersion, AxisPoint, Drift, DriftLine, Leaving, TrendPoint, TrendResponse
from labctl.calibration import read_calibration
from labctl.errors import BadInput, LabctlError
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.trend_line import MIN_POINTS, TrendLine, trend_line
from labctl.recording.info import GIVE_DATE, measured_at, ordered_at
from labctl.services.cache import UNNAMED, compute
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_version import (
    LARGEST_RATIO,
    applied_errors,
    expected_dps,
    left_by,
    mounting_angles_of,
)
from labctl.services.criticism.versions import version_of
from labctl.shown_unit import shown_unit
from labctl.store import CalibrationRecord, RecordingRow, Store

#: Recordings that begin less than this after the end of an earlier one are of one occasion.
MIN_INTERVAL = timedelta(days=1)


def in_time(rows: Iterable[RecordingRow]) -> tuple[list[RecordingRow], list[RecordingRow]]:
    """Return the recordings in order of time, of one instant by their numbers, and those whose date is not known."""
    every = sorted(rows, key=lambda row: (ordered_at(row.info), row.id))
    return [r for r in every if measured_at(r.info)], [r for r in every if not measured_at(r.info)]


def occasions_of(store: Store, measured: Sequence[RecordingRow]) -> list[list[int]]:
    """Return the numbers of recordings, in order of time, by occasion: those that overlap or are close are of one."""
    occasions: list[list[int]] = []
    reached = None
    for row in measured:
        begun = ordered_at(row.info)
        if reached is None or begun >= reached + MIN_INTERVAL:
            occasions.append([])
        occasions[-1].append(row.id)
        ends = [data_set.t_until_s for data_set in store.recordings.data_sets(row.id) if data_set.t_until_s is not None]
        until = begun + timedelta(seconds=max(ends, default=0.0))
        reached = until if reached is None else max(reached, until)
    return occasions


def occasions_text(occasions: Sequence[Sequence[int]], *, drifted: bool) -> Iterator[str]:
    """Yield why recordings of one occasion show no drift."""
    if len(occasions) == 1 and len(occasions[0]) > 1:
        yield (
            f"Recordings {_numbers(occasions[0])} overlap in time or are less than {MIN_INTERVAL.days * 24} h apart: "
            "they are one occasion, and show no drift over the years; record the unit again on another day."
        )
    elif len(occasions) > 1 and not drifted:
        yield "A drift needs two recordings that the version can be applied to, and its uncertainty three."


def undated_text(rows: Sequence[RecordingRow]) -> Iterator[str]:
    """Yield which recordings are left out because their date is not known, and what to do."""
    if rows:
        word, has = ("Recordings", "have") if len(rows) > 1 else ("Recording", "has")
        yield (
            f"{word} {_numbers([row.id for row in rows])} {has} no date of measurement and cannot be put in order of "
            f"time; {GIVE_DATE}."
        )


def _numbers(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))


YEAR = timedelta(days=365.25)
#: Data sets at less different rates than this show no scale factor.
MIN_RATES = 2
#: Points of a drawn line; it goes on to this many times the span of the recordings, beyond the time at which the limit
#: is reached by this factor, and no farther than this many spans.
DRAWN, BEYOND, REACHED, FARTHEST = 61, 1.5, 1.1, 4.0


def trend_unit(store: Store, serial: str, version: int | None = None, limit_dps: float | None = None) -> TrendResponse:
    """Return the trend of a unit by one of its versions (default: its first), over all its recordings in time.

    The limit is of the bias, deg/s; default: twice the error that the version states. Raises NotFound, BadInput.
    """
    compute(UNNAMED)
    compared = compared_with(store, serial, version)
    reference, measured, undated = compared.reference, compared.measured, compared.undated
    if limit_dps is not None and not (math.isfinite(limit_dps) and limit_dps > 0):
        raise BadInput(f"limit {limit_dps} deg/s: give a number above 0")
    points = [compared.point(Measurements(store, (row,))) for row in measured]
    occasions = occasions_of(store, measured)
    lines = list(_lines(points)) if len(occasions) > 1 else []
    limit = limit_dps if limit_dps is not None else _stated(reference)
    leaves = list(_leaving(lines, points, limit)) if limit and lines else []
    drawn = _drawn(points, leaves)
    drifts = [_drift(axis, figure, unit_symbol, line, points, drawn) for axis, figure, unit_symbol, line in lines]
    return TrendResponse(
        serial=serial, version=reference.version, limit_dps=limit, points=points, drifts=drifts, leaves=leaves,
        undated=[row.id for row in undated],
        text=[
            *_text(drifts, len(points)), *occasions_text(occasions, drifted=bool(drifts)),
            *_leaving_text(leaves, drifts, limit), *undated_text(undated),
        ],
    )  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """A version, and the recordings of its unit that it is compared with."""

    store: Store
    reference: CalibrationRecord
    measured: Sequence[RecordingRow]  #: in order of time
    undated: Sequence[RecordingRow]
    dated: Sequence[CalibrationRecord]  #: versions, rising, that no recording without a date was fitted to

    def point(self, data: Measurements) -> TrendPoint:
        """Return what the versions leave of one recording, by its means."""
        return _point(self.store, data, self.reference, self.dated, self.measured)

    def errors(self, data: Measurements) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return axis -> error of each data set of one recording, (m,) deg/s, and axis -> its true rate."""
        return errors_left(data, self.reference, [v for v in self.dated if data.row.id in v.recordings])


def compared_with(store: Store, serial: str, version: int | None) -> Compared:
    """Return a version (default: the first) and what it is compared with. Raises NotFound, BadInput."""
    rows = sorted(store.calibrations.of_unit(store.units.get(serial).serial), key=lambda row: row.version)
    reference = version_of(store, serial, version if version is not None or not rows else rows[0].version)
    measured, undated = in_time(
        row
        for row in store.recordings.of_unit(serial)
        if row.kind == "points" or (row.kind == "samples" and row.datasets)
    )
    undated_ids = {each.id for each in undated}
    dated = [row for row in rows if not undated_ids.intersection(row.recordings)]
    return Compared(store, reference, measured, undated, dated)


def _stated(row: CalibrationRecord) -> float | None:
    return LARGEST_RATIO * expected if (expected := expected_dps(row)) else None


def _point(
    store: Store, data: Measurements, reference: CalibrationRecord, versions: Sequence[CalibrationRecord],
    measured: Sequence[RecordingRow],
) -> TrendPoint:  # fmt: skip
    """Return what the versions leave of one recording."""
    row = data.row
    at = {each.id: ordered_at(each.info) for each in measured}
    before = [v for v in versions if v.recordings and all(at[n] < at[row.id] for n in v.recordings if n in at)]
    fitted_versions = [v for v in versions if row.id in v.recordings]
    point = TrendPoint(
        recording=row.id, at=at[row.id], as_found=_applied(store, before[-1:], data),
        as_left=_applied(store, fitted_versions[-1:], data), rms_dps=None, axes={},
    )  # fmt: skip
    try:
        errors, rates_dps = errors_left(data, reference, fitted_versions)
    except LabctlError as error:
        return point.model_copy(update={"why": str(error)})
    axes = {axis: line_left(values, rates_dps[axis]) for axis, values in errors.items()}
    pooled = np.concatenate(list(errors.values()))
    return point.model_copy(update={"rms_dps": float(np.sqrt(np.mean(pooled**2))), "axes": axes})


def errors_left(
    data: Measurements, reference: CalibrationRecord, fitted_versions: Sequence[CalibrationRecord]
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return axis -> what a version leaves of each data set of a recording, (m,) deg/s, and axis -> their true rates.

    The mountings are those of the newest version that was fitted to the recording. Raises BadInput, NotEnoughData.
    """
    angles = mounting_angles_of(read_calibration(fitted_versions[-1].document)) if fitted_versions else None
    errors, _ = applied_errors(read_calibration(reference.document), data.points, angles_rad=angles)
    channels = fit_data_of(data.points)
    return errors, {axis: channels.true_rate_dps(axis) for axis in errors}


def _applied(store: Store, version: Sequence[CalibrationRecord], data: Measurements) -> AppliedVersion | None:
    if not version:
        return None
    try:
        errors = left_by(store, version[0], data)
    except LabctlError:
        return None
    return AppliedVersion(
        version=version[0].version, rms_dps=errors.rms_dps, max_dps=errors.max_dps, bias_dps=errors.bias_dps,
        part=errors.part,
    )  # fmt: skip


def line_left(error_dps: Array, rate_dps: Array) -> AxisPoint:
    """Return what is left of bias and scale factor on one axis: a straight line over the rate, by least squares."""
    has_rates = len(np.unique(np.round(rate_dps, 3))) >= MIN_RATES
    columns = np.column_stack([np.ones(len(rate_dps)), rate_dps] if has_rates else [np.ones(len(rate_dps))])
    coefficients, *_ = np.linalg.lstsq(columns, error_dps, rcond=None)
    residual = error_dps - columns @ coefficients
    variance = float(residual @ residual) / max(len(residual) - columns.shape[1], 1)
    u = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)) * variance)
    return AxisPoint(
        bias_dps=float(coefficients[0]), u_bias_dps=float(u[0]),
        scale_factor=float(coefficients[1]) if has_rates else None, u_scale_factor=float(u[1]) if has_rates else None,
    )  # fmt: skip


def _lines(points: Sequence[TrendPoint]) -> Iterator[tuple[str, str, str, TrendLine]]:
    """Yield (axis, what, unit, line over the years since the first recording)."""
    series: dict[tuple[str, str, str], list[tuple[float, float, float]]] = {}
    for point in points:
        years = (point.at - points[0].at) / YEAR
        for axis, axis_error in point.axes.items():
            series.setdefault((axis, "bias", "deg/s"), []).append((years, axis_error.bias_dps, axis_error.u_bias_dps))
            if axis_error.scale_factor is not None and axis_error.u_scale_factor is not None:
                series.setdefault((axis, "scale_factor", "1"), []).append(
                    (years, axis_error.scale_factor, axis_error.u_scale_factor)
                )
        if point.rms_dps is not None:
            series.setdefault(("all", "error", "deg/s"), []).append((years, point.rms_dps, 0.0))
    for (axis, figure, unit_symbol), rows in series.items():
        time, values, u = np.array(rows).T
        if (line := trend_line(time, values, u)) is not None:
            yield axis, figure, unit_symbol, line


def _drawn(points: Sequence[TrendPoint], leaves: Sequence[Leaving]) -> Array:
    """Return the years since the first recording at which a line is drawn: half as far again, or to the limit."""
    if not points:
        return np.zeros(0)
    last = (points[-1].at - points[0].at) / YEAR
    reached = [(leaf.expected - points[0].at) / YEAR for leaf in leaves if leaf.expected is not None]
    until = min(max([BEYOND * last, *(REACHED * years for years in reached)]), FARTHEST * last)
    return np.linspace(0.0, until, DRAWN)


def _course(line: TrendLine, points: Sequence[TrendPoint], years: Array) -> DriftLine:
    value, half = line.at(years)
    has_freedom = line.freedom > 0
    return DriftLine(
        at=[points[0].at + year * YEAR for year in years.tolist()],
        value=value.tolist(),
        low=(value - half).tolist() if has_freedom else [None] * len(years),
        high=(value + half).tolist() if has_freedom else [None] * len(years),
    )


def _drift(
    axis: str, what: str, unit_symbol: str, line: TrendLine, points: Sequence[TrendPoint], years: Array
) -> Drift:  # fmt: skip
    has_freedom = line.freedom > 0
    half = line.factor * line.u_slope
    return Drift(
        axis=axis, what=what, unit=f"{unit_symbol}/year" if unit_symbol != "1" else "1/year", points=line.freedom + 2,
        per_year=line.slope, u=line.u_slope if has_freedom else None,
        low=line.slope - half if has_freedom else None, high=line.slope + half if has_freedom else None,
        repeatability=line.repeatability, significant=has_freedom and abs(line.slope) > half,
        line=_course(line, points, years),
    )  # fmt: skip


def _leaving(
    lines: Sequence[tuple[str, str, str, TrendLine]], points: Sequence[TrendPoint], limit: float
) -> Iterator[Leaving]:
    last = (points[-1].at - points[0].at) / YEAR

    def at(years: float | None) -> datetime | None:
        return None if years is None else (points[0].at + years * YEAR).astimezone(UTC)

    for axis, figure, _, line in lines:
        if figure == "bias":
            expected, earliest, latest = map(at, line.leaves(limit, last))
            outside = abs(float(line.at(np.array([last]))[0][0])) > limit
            yield Leaving(axis=axis, outside=outside, expected=expected, earliest=earliest, latest=latest)


def _text(drifts: Sequence[Drift], points: int) -> Iterator[str]:
    if not drifts and points < 2:
        word = "recording" if points == 1 else "recordings"
        yield f"{points} {word} in time: a drift needs two recordings, and its uncertainty three."
    for drift in drifts:
        text = f"Axis {drift.axis}, {drift.what}" if drift.axis != "all" else "RMS error over all axes"
        shown = shown_unit(drift.unit.removesuffix("/year"), drift.what)
        per_year = f"{shown.number(drift.per_year)} {shown.unit}/year"
        if drift.u is None or drift.low is None or drift.high is None:
            figure = f"{text}: {per_year}"
            yield f"{figure} from two recordings; its uncertainty needs {MIN_POINTS} recordings."
        else:
            is_drift = "drifts by" if drift.significant else "no drift beyond repeatability:"
            yield f"{text}: {is_drift} {per_year} (95 %: {shown.number(drift.low)} to {shown.number(drift.high)})."


def _leaving_text(leaves: Sequence[Leaving], drifts: Sequence[Drift], limit: float | None) -> Iterator[str]:
    drifting = {drift.axis for drift in drifts if drift.what == "bias" and (drift.significant or drift.u is None)}
    for each in leaves:
        if each.outside:
            yield f"Axis {each.axis}: the bias is already outside {limit:.3g} deg/s at the newest recording."
            continue
        when: Mapping[str, str] = {
            name: f"{value:%Y-%m-%d}" if value else "not within 50 years"
            for name, value in (("expected", each.expected), ("earliest", each.earliest), ("latest", each.latest))
        }
        if each.axis not in drifting:  # the date at which a line of no known sign passes a limit means nothing
            until = f"until {each.earliest:%Y-%m-%d}" if each.earliest else "for at least 50 years"
            yield f"Axis {each.axis}: with 95 % confidence the bias stays within {limit:.3g} deg/s {until}."
            continue
        yield (
            f"Axis {each.axis}: the bias passes the limit of {limit:.3g} deg/s: expected {when['expected']}, earliest "
            f"{when['earliest']}, latest {when['latest']}."
        )
