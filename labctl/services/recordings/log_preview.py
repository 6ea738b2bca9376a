"""A log as a page shows it before it is imported: map, first rows, traces, problems."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.answers.inspection import DataWarning
from labctl.answers.recordings import LogColumn, LogPreview, LogTarget, LogTrace
from labctl.recording.column_map import ColumnMap, map_document, map_text
from labctl.recording.column_map.sources import source, unused
from labctl.recording.column_map.time_order import in_order_of_time
from labctl.recording.column_map.units import LSB, QUANTITIES, unit_of_target
from labctl.recording.columns import COLUMNS
from labctl.recording.raw_table import RawTable
from labctl.recording.sanity import findings_of, summarise
from labctl.recording.sanity.readings import examine
from labctl.services.recordings.importers import log_with_map
from labctl.services.recordings.logs import MappedFile
from labctl.services.recordings.time_order import OutOfOrder, leaves_out_rows, refuse_unknown
from labctl.services.recordings.warnings import warning_of
from labctl.store import Store

#: Bins of a trace, and columns that have one.
BINS, MAX_TRACES = 300, 24
#: Columns of a recording that a log does not have: made by the import, or belonging to means and coefficients.
_NOT_OF_LOGS = ("dataset", "scale_factor", "offset", "axis", "n")

Array = NDArray[np.float64]


def preview_log(
    store: Store,  # noqa: ARG001  a computation gets it
    path: Path,
    importer: str | None,
    options: Mapping[str, str],
    column_map: ColumnMap | None,
    leave_out: Sequence[str] = (),
) -> LogPreview:
    """Return what a log would become by a map, or by the one that is proposed; raises BadInput, BadRecording.

    `leave_out` are kinds of findings whose readings are to be left out; of them only `time_back` changes what a log
    becomes, the others mark readings.
    """
    refuse_unknown(leave_out)
    mapped_log = log_with_map(path, importer, options, column_map, OutOfOrder() if leaves_out_rows(leave_out) else None)
    table, chosen = mapped_log.table, mapped_log.column_map
    sources = {target: source(table, mapped.source) for target, mapped in chosen.columns.items()}
    target_of = {column.name: target for target, column in sources.items() if column is not None}
    log = mapped_log.log
    return LogPreview(
        file=path.name,
        importer=mapped_log.importer,
        title=mapped_log.title,
        rows=table.rows,
        columns=[
            LogColumn(name=name, unit=column.unit, is_text=not column.is_number, target=target_of.get(name, ""))
            for name, column in table.columns.items()
        ],
        first_rows=table.shown_rows(),
        column_map=map_document(chosen),
        map_toml=map_text(chosen),
        guesses=mapped_log.guesses,
        problems=mapped_log.problems,
        warnings=_warnings(mapped_log),
        unused=unused(table, chosen),
        serial=log.recording.info.serial if log is not None else None,
        motion=log.motion if log is not None else None,
        datasets=None if log is None else len(np.unique(np.asarray(log.recording.columns["dataset"]))),
        duration_s=_duration(mapped_log),
        traces=_traces(table, mapped_log),
        targets=_targets(),
    )


def _warnings(mapped: MappedFile) -> list[DataWarning]:
    """Return what is wrong with rows, readings and data sets, as an inspection of the file says it."""
    _, of_rows = in_order_of_time(mapped.table, mapped.column_map)
    findings = [] if of_rows is None else [of_rows]
    if mapped.log is not None:
        recording = mapped.log.recording
        of_readings = [*findings, *(found.finding for found in examine(recording))]
        findings = findings_of(summarise(recording), recording.environment, of_readings)
    return [warning_of(finding) for finding in findings]


def _duration(mapped: MappedFile) -> float | None:
    if mapped.log is None or "t_s" not in mapped.log.recording.columns:
        return None
    t_s = np.asarray(mapped.log.recording.columns["t_s"], dtype=np.float64)
    return float(t_s[-1] - t_s[0])


def _traces(table: RawTable, mapped: MappedFile) -> list[LogTrace]:
    n = table.rows
    x = np.arange(1, n + 1, dtype=np.float64)
    if mapped.log is not None and "t_s" in mapped.log.recording.columns:
        t_s = np.asarray(mapped.log.recording.columns["t_s"], dtype=np.float64)
        x = t_s if len(t_s) == n else x
    numbers = [column for column in table.columns.values() if column.is_number][:MAX_TRACES]
    starts = np.unique(np.linspace(0, n, BINS + 1).astype(np.int64)[:-1])
    middle = x[np.minimum(starts + np.diff(np.append(starts, n)) // 2, n - 1)]
    return [
        LogTrace(
            name=number.name, x=middle.tolist(), low=_least(number.values, starts), high=_most(number.values, starts)
        )
        for number in numbers
    ]


def _least(values: Array, starts: NDArray[np.int64]) -> list[float | None]:
    return _finite(np.fmin.reduceat(values, starts))


def _most(values: Array, starts: NDArray[np.int64]) -> list[float | None]:
    return _finite(np.fmax.reduceat(values, starts))


def _finite(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def _targets() -> list[LogTarget]:
    return [
        LogTarget(name=column.name, meaning=column.meaning, unit=unit, units=_units(unit), aliases=_aliases(unit))
        for column in COLUMNS
        if column.name not in _NOT_OF_LOGS and not column.name.endswith("_std")
        for unit in [unit_of_target(column.name)]
    ]


def _aliases(quantity: str) -> dict[str, str]:
    return {alias.lower(): unit.name for unit in QUANTITIES.get(quantity, ()) for alias in unit.aliases}


def _units(quantity: str) -> list[str]:
    return [*(unit.name for unit in QUANTITIES[quantity]), LSB] if quantity in QUANTITIES else []
