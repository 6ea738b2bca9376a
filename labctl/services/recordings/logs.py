"""A log and its column map together: what it would become, everything that is wrong with it, and what to ask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from labctl.errors import BadFile
from labctl.recording import Recording
from labctl.recording.column_map import (
    ColumnMap,
    MappedLog,
    checked_map,
    completed,
    map_document,
    propose,
    recording_of,
)
from labctl.recording.column_map.day_column import with_days
from labctl.recording.importer import TableImporter, TableOptionsT
from labctl.recording.logs.beside import joined
from labctl.recording.raw_table import RawTable
from labctl.services.recordings.time_order import OutOfOrder


@dataclass(frozen=True)
class MappedFile:
    """A log as an importer read it, with its map; `log` is None where `problems` say what is wrong."""

    importer: str
    title: str
    table: RawTable
    column_map: ColumnMap
    proposed: bool  #: the map is a proposal, not accepted yet
    guesses: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    log: MappedLog | None = None

    @property
    def recording(self) -> Recording:
        """The recording; raises BadFile with everything that is wrong."""
        if self.log is None:
            raise BadFile.of(self.table.path, self.problems)
        return self.log.recording


#: Is shown what a log would become; raises where that is not wanted.
Accept = Callable[[MappedFile], None]


def mapped_file(
    name: str, importer: TableImporter[TableOptionsT], path: Path, options: TableOptionsT, column_map: ColumnMap | None,
    beside: Sequence[RawTable] = (), out_of_order: OutOfOrder | None = None,
) -> MappedFile:  # fmt: skip
    """Return what a log becomes by a map, or by the one that is proposed; raises BadRecording for what is no log.

    `beside` are the tables of further files of the same run. With `out_of_order` the rows whose time goes back are
    left out, and that keeps which they were.
    """
    read, of_day = with_days(importer.table(path, given_layout(options, column_map)))
    table = joined(read, beside, column_map)
    proposal = propose(table) if column_map is None else completed(table, column_map)
    chosen = proposal.column_map
    if options.serial is not None:
        chosen = checked_map({**map_document(chosen), "serial": options.serial}, "--option serial")
    if options.started_at is not None:
        chosen = chosen.model_copy(update={"started_at": options.started_at})
    guesses = [*([of_day] if of_day else []), *proposal.guesses]
    mapped = MappedFile(name, importer.title, table, chosen, column_map is None, guesses)
    used = table if out_of_order is None else out_of_order.rows_in_order(table, chosen)
    try:
        log = recording_of(used, chosen)
    except BadFile as error:
        return replace(mapped, problems=error.problems)
    if out_of_order is not None:
        log = replace(log, recording=out_of_order.stated(log.recording, table.rows))
    return replace(mapped, log=log)


def given_layout(options: TableOptionsT, column_map: ColumnMap | None) -> TableOptionsT:
    """Return options with what a map says about the layout of a text, where the importer reads texts."""
    if column_map is None or "file" not in type(options).model_fields:
        return options
    return options.model_copy(update={"file": column_map.file})
