"""What `labctl import` shows of a log before anything is kept: its map, its first rows, and the question."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.output import console, stderr, table

if TYPE_CHECKING:
    from labctl.recording.column_map import ColumnMap
    from labctl.services.recordings.logs import MappedFile

#: Columns of the first rows that are shown side by side.
SHOWN_COLUMNS = 10
SHOWN_ROWS = 4


def print_template(kind: str) -> None:
    """Print the CSV template of a kind of data."""
    with one_clear_line():
        from labctl.recording.column_map.templates import template

        sys.stdout.write(template(kind))


def named(path: Path | None) -> Path:
    """Return the path; raises BadInput where none was given."""
    from labctl.errors import BadInput

    if path is None:
        raise BadInput("name the file or folder to import, or ask for a template with --template KIND")
    return path


def read_given(path: Path | None) -> ColumnMap | None:
    """Return the map of a file, None where none was given; raises BadInput."""
    from labctl.recording.column_map import read_map

    return None if path is None else read_map(path)


class Acceptance:
    """Whether a log may be imported by a map: given, accepted beforehand, or asked at the terminal.

    `out` is where the map is to be written; `quiet` prints nothing, for `--json`.
    """

    def __init__(self, path: Path, *, given: bool, accepted: bool, out: Path | None, quiet: bool) -> None:
        self.path, self.given, self.accepted, self.out, self.quiet = path, given, accepted, out, quiet

    def ask(self, mapped: MappedFile) -> None:
        """Show a log with its map and get the decision; raises BadInput, typer.Exit where nothing is to be imported."""
        if self.out is not None:
            self._write(mapped)
        if mapped.problems:
            self._refuse(mapped)
        if not self.quiet:
            show(mapped)
        if self.given or self.accepted:
            return
        self._decide()

    def _write(self, mapped: MappedFile) -> None:
        from labctl.errors import BadInput
        from labctl.recording.column_map import map_text

        assert self.out is not None
        if self.out.exists():
            raise BadInput(f"--write-map {self.out}: exists already; name a new file")
        self.out.write_text(map_text(mapped.column_map), encoding="utf-8")
        if not self.accepted and not mapped.problems:
            if not self.quiet:
                show(mapped)
            stderr.print(
                f"map -> {self.out}; nothing was imported: labctl import {self.path} --map {self.out}", style="dim"
            )
            raise typer.Exit(0)

    def _refuse(self, mapped: MappedFile) -> None:
        from labctl.errors import BadFile

        lines = list(mapped.problems)
        if self.out is not None:
            hint = f"the map was written to {self.out}: correct that file and import with --map {self.out}"
        elif not self.given and any("[" in line or "sample_rate_hz" in line for line in lines):
            hint = (
                f"`labctl import {self.path} --write-map MAP.toml` writes the incomplete map; correct that file "
                "and give it with --map"
            )
        else:
            raise BadFile.of(self.path, lines)
        raise BadFile.of(self.path, [f"{lines[0]} ({hint})"] if len(lines) == 1 else [*lines, hint])

    def _decide(self) -> None:
        from labctl.errors import BadInput

        advice = (
            "add --accept-map to import with this map, or write it with --write-map MAP.toml, correct it and give it "
            "with --map MAP.toml"
        )
        if self.quiet or not sys.stdin.isatty():
            raise BadInput(f"{self.path}: this map is proposed and not yet accepted; {advice}")
        if not typer.confirm("import the log with this column map?", default=False, err=True):
            stderr.print(f"nothing was imported; {advice}", style="dim")
            raise typer.Exit(1)


def show(mapped_file: MappedFile) -> None:
    """Print what a log would become: its map, what was guessed, its first rows, and columns without use."""
    log = mapped_file.log
    word = "proposed map" if mapped_file.proposed else "map"
    console.print(f"{mapped_file.table.path.name}: {mapped_file.title}, {mapped_file.table.rows} rows; {word}:")
    mapped = table("", "column of the recording", "from", "unit", "scale")
    for target, column in mapped_file.column_map.columns.items():
        raw = mapped_file.table.columns.get(str(column.source))
        unit = column.unit or (raw.unit if raw is not None else "")
        mapped.add_row(target, str(column.source), unit or "–", "" if column.scale is None else f"{column.scale:g}")
    console.print(mapped)
    for guess in mapped_file.guesses:
        console.print(f"guessed: {guess}", style="yellow")
    names = list(mapped_file.table.columns)[:SHOWN_COLUMNS]
    rows = table("first rows", *(name for name in names))
    for row in mapped_file.table.shown_rows()[:SHOWN_ROWS]:
        rows.add_row(*(cell for cell in row[: len(names)]))
    console.print(rows)
    if log is not None:
        info = log.recording.info
        sets = len(set(log.recording.columns["dataset"].tolist()))
        measured_at = info.measured_at
        console.print(
            f"serial {info.serial}; motion {log.motion}; data sets by {mapped_file.column_map.datasets.by}: {sets}; "
            + (f"began {measured_at:%Y-%m-%d %H:%M:%S} UTC" if measured_at else "date of the measurement not known")
        )  # fmt: skip
        if log.unused:
            console.print(f"not used: {', '.join(log.unused)}")
