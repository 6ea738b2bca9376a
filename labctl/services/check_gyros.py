"""Check gyros: a unit that is measured in each campaign, its bias and scale factor on control charts.

Each recording is judged by the newest version that was fitted to it alone, so that no later campaign is in its result.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from functools import lru_cache
from typing import Literal

from labctl.answers.validity import CheckGyroChart, CheckGyroPoint, CheckGyroRequest, CheckGyroResponse
from labctl.calibration import read_calibration
from labctl.errors import BadInput, LabctlError, NotEnoughData
from labctl.metrology.control_chart import ChartPoint, Judged, judged
from labctl.recording.checks import POSSIBLE
from labctl.recording.info import GIVE_DATE, measured_at, ordered_at
from labctl.services.cache import UNNAMED, compute
from labctl.services.calibrations.uncertainty import coefficients_at
from labctl.services.standards.checks import limits_answer, out_text
from labctl.store import CheckGyroRow, RecordingRow, Store

Result = Literal["bias", "scale_factor"]
UNITS: dict[Result, str] = {"bias": "deg/s", "scale_factor": "1"}
#: Temperature of a unit whose model knows none, deg C.
ROOM_C = 25.0
#: Results in memory: a monitor asks for every check gyro each time.
MAX_RESULTS = 1024


@dataclass(frozen=True)
class _Found:
    """What one recording shows: axis and result -> value and standard uncertainty."""

    row: RecordingRow
    version: int
    values: dict[tuple[str, Result], tuple[float, float | None]]


def set_check_gyro(store: Store, serial: str, request: CheckGyroRequest, at: datetime) -> CheckGyroResponse:
    """Make a unit a check gyro, or end that. Raises NotFound, NotEnoughData for a unit without a version."""
    stored_serial = store.units.get(serial).serial
    temperature_c = _temperature(store, stored_serial, request.temperature_c) if request.marked else None
    act: Literal["mark", "unmark"] = "mark" if request.marked else "unmark"
    store.check_gyros.add(
        CheckGyroRow(stored_serial, act, temperature_c, request.chart_from, request.reason, request.by, at)
    )
    return check_gyro(store, stored_serial)


def list_check_gyros(store: Store) -> list[CheckGyroResponse]:
    """Return every unit that is marked, by serial number, with its charts."""
    return [check_gyro(store, row.serial) for row in store.check_gyros.all()]


def check_gyro(store: Store, serial: str, temperature_c: float | None = None) -> CheckGyroResponse:
    """Return the charts of a unit, at another temperature where one is given.

    Raises NotFound; NotEnoughData for a unit without a version.
    """
    compute(UNNAMED)
    stored_serial = store.units.get(serial).serial
    mark = next((row for row in store.check_gyros.all() if row.serial == stored_serial), None)
    chosen = temperature_c if temperature_c is not None else mark.temperature_c if mark else None
    at_c = _temperature(store, stored_serial, chosen)
    first = mark.chart_from if mark else None
    results, left_out = _results(store, stored_serial, at_c, first)
    charts = list(_charts(results))
    newest = [
        (chart, judgements[-1]) for chart, judgements in charts if chart.points[-1].recording == results[-1].row.id
    ]
    out = [(chart, one) for chart, one in newest if one.state == "out"]
    return CheckGyroResponse(
        serial=stored_serial, marked=mark is not None, temperature_c=at_c, chart_from=first, alarm=bool(out),
        charts=[chart for chart, _ in charts], left_out=left_out,
        text=list(_text(stored_serial, at_c, results, newest)),
    )  # fmt: skip


def alarms(store: Store) -> int:
    """Return of how many check gyros the newest result is out of limits; one that cannot be judged is none."""
    count = 0
    for row in store.check_gyros.all():
        try:
            count += check_gyro(store, row.serial).alarm
        except LabctlError:
            continue
    return count


def _temperature(store: Store, serial: str, temperature_c: float | None) -> float:
    if temperature_c is not None:
        low, high = POSSIBLE["temperature_c"]
        if not low <= temperature_c <= high:  # also true for NaN
            raise BadInput(
                f"temperature_c = {temperature_c} deg C: give a temperature between {low:g} and {high:g} deg C"
            )
        return temperature_c
    versions = store.calibrations.of_unit(serial)
    if not versions:
        raise NotEnoughData(f"unit {serial} has no version; fit one with `labctl fit {serial}`")
    low, high = read_calibration(versions[-1].document).temperature_c
    return (low + high) / 2 if math.isfinite(low) and math.isfinite(high) else ROOM_C


def _results(store: Store, serial: str, at_c: float, first: date | None) -> tuple[list[_Found], dict[int, str]]:
    """Return the results of the recordings in order of time, and why others have none."""
    versions = store.calibrations.of_unit(serial)
    results, left_out = list[_Found](), dict[int, str]()
    measured = [
        row
        for row in store.recordings.of_unit(serial)
        if row.kind != "coefficients" and row.datasets and (first is None or ordered_at(row.info).date() >= first)
    ]
    for row in sorted(measured, key=lambda each: (ordered_at(each.info), each.id)):
        if measured_at(row.info) is None:
            left_out[row.id] = f"the date of the measurement is not known; {GIVE_DATE}"
            continue
        version_of_row = next((version for version in versions if version.recordings == (row.id,)), None)
        if version_of_row is None:
            left_out[row.id] = f"no version is fitted to it alone: `labctl fit {serial} --recording {row.id}`"
            continue
        try:
            values = _values(version_of_row.hash, version_of_row.document, at_c)
        except (BadInput, NotEnoughData) as error:
            left_out[row.id] = f"version {version_of_row.version}: {error}"
            continue
        results.append(_Found(row, version_of_row.version, dict(values)))
    return results, left_out


@lru_cache(maxsize=MAX_RESULTS)
def _values(
    _hash: str, document: bytes, at_c: float
) -> tuple[tuple[tuple[str, Result], tuple[float, float | None]], ...]:
    """Return the results of a version at a temperature; a document never changes. Raises BadInput, NotEnoughData."""
    return tuple(
        ((axis, name), (budget.value, budget.combined))
        for axis, budgets in coefficients_at(read_calibration(document), at_c).items()
        for name in UNITS
        if (budget := budgets.get(name)) is not None and budget.value is not None
    )


def _charts(results: Sequence[_Found]) -> Iterator[tuple[CheckGyroChart, list[Judged]]]:
    for key in dict.fromkeys(key for each in results for key in each.values):
        those = [each for each in results if key in each.values]
        judgements = judged([ChartPoint(*each.values[key]) for each in those])
        points = [_point(each, judgement) for each, judgement in zip(those, judgements, strict=True)]
        axis, result = key
        yield CheckGyroChart(axis=axis, result=result, unit=UNITS[result], points=points), judgements


def _point(result: _Found, one: Judged) -> CheckGyroPoint:
    return CheckGyroPoint(
        recording=result.row.id, campaign=result.row.campaign, at=ordered_at(result.row.info), version=result.version,
        value=one.point.value, u=one.point.u, state=one.state, limits=[limits_answer(limit) for limit in one.limits],
    )  # fmt: skip


def _text(
    serial: str, at_c: float, results: Sequence[_Found], judgements: Sequence[tuple[CheckGyroChart, Judged]]
) -> Iterator[str]:
    if not results:
        yield f"Check gyro {serial}: no recording has a version of its own; there is nothing to judge."
        return
    newest = results[-1]
    place_text = f"campaign {newest.row.campaign}" if newest.row.campaign is not None else f"recording {newest.row.id}"
    states = {one.state for _, one in judgements}
    for chart, one in judgements:
        if one.state == "out":
            at = f" at {at_c:g} deg C" if chart.result == "bias" else ""
            yield (
                f"ALARM, check gyro {serial}, {place_text}, {chart.result} of axis {chart.axis}{at}: "
                f"{out_text(one.point.value, chart.unit, one)}. Check the bench and its standards before the results "
                "of this campaign are used."
            )
    if states == {"unknown"}:
        yield f"Check gyro {serial}, {place_text}: the first result; control limits need a second one."
    elif "out" not in states:
        yield f"Check gyro {serial}, {place_text}: every result is within the control limits."
