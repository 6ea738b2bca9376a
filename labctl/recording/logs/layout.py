"""How a text file is divided: separator, decimal sign, the line of the names and the first line of readings."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from labctl.errors import BadRecording
from labctl.recording.column_map.model import SEPARATORS, FileKeys
from labctl.recording.column_map.names import is_unit
from labctl.recording.logs.encoding import encoding_of
from labctl.recording.raw_table import FileLayout

#: Lines that are inspected.
LOOKED_AT = 200
#: The longest line that readings stand in.
LONGEST_LINE = 1 << 15
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
#: What stands in a row of units for a column that has none.
_NO_UNIT = frozenset({"", "-", "–", "1", "n/a", "none", "no", "#"})
_MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "inf", "-inf"})


@dataclass(frozen=True)
class _Division:
    separator: str
    width: int  #: columns that most lines have
    score: float  #: share of lines with that width, and of their cells that are numbers


def lines_of(path: Path, head: bytes, encoding: str) -> list[str]:
    """Return the first lines of a text; the last may be cut off and is left out where there is more than one."""
    text = head.decode("utf-8-sig" if encoding == "utf-8" else encoding, errors="ignore")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if max(len(line) for line in lines) > LONGEST_LINE:
        raise BadRecording(
            f"{path}: a line is longer than {LONGEST_LINE} characters; expected one reading in each line"
        )
    whole = lines[:-1] if len(lines) > 1 and path.stat().st_size > len(head) else lines
    return whole[:LOOKED_AT]


@dataclass(frozen=True)
class Header:
    """Names of the columns, and their units where a row below the names states them, else empty."""

    names: list[str]
    units: list[str]


def layout_of(path: Path, head: bytes, file_keys: FileKeys) -> tuple[FileLayout, Header]:
    """Return how a file is divided and what its header says; what `file_keys` says is not looked for."""
    encoding = file_keys.encoding or encoding_of(path, head)
    lines = lines_of(path, head, encoding)
    if not any(line.strip() for line in lines):
        raise BadRecording(f"{path}: only empty lines; expected a header and readings")
    separator = SEPARATORS[file_keys.separator] if file_keys.separator else _separator(lines)
    cells = [split(line, separator) for line in lines]
    data = file_keys.data or _first_data(path, lines, cells)
    header = _header(lines, cells, data) if file_keys.header is None else file_keys.header
    units_row = _units_row(cells, header, data)
    if file_keys.header is None and units_row == header:
        header = _header(lines, cells, units_row) or header
    below = [row for line, row in zip(lines[data - 1 :], cells[data - 1 :], strict=True) if line.strip()]
    width = Counter(len(row) for row in below).most_common(1)[0][0] if below else 0
    if width == 0:
        raise BadRecording(
            f"{path}: no row of readings below the header; check that the file is complete, or give another file"
        )
    decimal = file_keys.decimal or _decimal(below, separator)
    if header > len(lines):
        raise BadRecording(
            f"{path}: header = {header} is beyond the {len(lines)} lines at the beginning of the "
            "file that labctl reads; correct header in [file]"
        )
    names = _names(cells[header - 1] if header else [], width)
    units = [_bare(cell) for cell in cells[units_row - 1][:width]] if 0 < units_row != header else []
    return FileLayout(encoding, separator, decimal, header, data), Header(names, units + [""] * (width - len(units)))


def split(line: str, separator: str) -> list[str]:
    """Return the cells of one line."""
    if separator == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error:
        return line.split(separator)


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma, or says that there is none."""
    return cell.lower() in _MISSING or _NUMBER.fullmatch(cell) is not None


def _separator(lines: list[str]) -> str:
    divisions = [_division(lines, separator) for separator in SEPARATORS.values()]
    best = max(
        divisions,
        key=lambda division: (division.score > 0, division.width > 1, round(division.score, 1), division.width),
    )
    return best.separator


def _division(lines: list[str], separator: str) -> _Division:
    rows = [split(line, separator) for line in lines if line.strip() and not line.startswith("#")]
    width, n = Counter(len(row) for row in rows).most_common(1)[0] if rows else (0, 0)
    usual = [row for row in rows if len(row) == width]
    numbers = sum(is_number(cell) and cell != "" for row in usual for cell in row)
    total = sum(cell != "" for row in usual for cell in row)
    return _Division(separator, width, n / len(rows) * numbers / total if rows and total else 0.0)


def _first_data(path: Path, lines: list[str], cells: list[list[str]]) -> int:
    """Return the first line, from 1, that holds numbers as most of the lines below it do."""
    for index, (line, row) in enumerate(zip(lines, cells, strict=True)):
        numbers = sum(is_number(cell) and cell != "" for cell in row)
        if line.startswith("#") or not row or numbers == 0:
            continue
        ahead = [len(each) for each in cells[index : index + 20] if any(each)]
        if numbers >= 0.3 * sum(cell != "" for cell in row) and len(row) == Counter(ahead).most_common(1)[0][0]:
            return index + 1
    raise BadRecording(
        f"{path}: the first {len(lines)} lines contain no row of numbers, so the file has no readings (it begins "
        f"{lines[0][:60]!r}); expected one row for each reading, columns separated by , ; tab or blanks"
    )


def _header(lines: list[str], cells: list[list[str]], data: int) -> int:
    width = len(cells[data - 1])
    for index in range(data - 2, -1, -1):
        if not lines[index].strip():
            continue
        row = [cell for cell in cells[index] if cell]
        words = sum(not is_number(cell) for cell in row)
        if len(cells[index]) >= max(1, width - 1) and row and words >= 0.5 * len(row):
            return index + 1
    return 0


def _units_row(cells: list[list[str]], header: int, data: int) -> int:
    """Return the line, from 1, between the names and the data that holds units alone; 0 where there is none."""
    for line in range(max(header, 1), data):
        row = [_bare(cell) for cell in cells[line - 1]]
        if any(map(is_unit, row)) and all(is_unit(cell) or cell in _NO_UNIT for cell in row):
            return line
    return 0


def _bare(cell: str) -> str:
    return cell.strip().lstrip("#").strip().strip('"').strip("[]() \t")


def _decimal(rows: list[list[str]], separator: str) -> str:
    cells = [cell for row in rows for cell in row]
    commas = sum(_COMMA.fullmatch(cell) is not None for cell in cells)
    points = sum("." in cell and is_number(cell) for cell in cells)
    return "," if separator != "," and commas > points else "."


def _names(header: list[str], width: int) -> list[str]:
    names = [name.strip().lstrip("#").strip().strip('"').strip() for name in header[:width]]
    names += [""] * (width - len(names))
    return [name or f"column {number}" for number, name in enumerate(names, start=1)]
