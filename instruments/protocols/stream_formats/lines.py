"""Readings from lines of decimal numbers."""

from __future__ import annotations

from enum import Enum

import numpy as np

from instruments.protocols.byte_lines import split_lines
from instruments.protocols.stream_formats.checksums import algorithm
from instruments.protocols.stream_formats.document import LineLayout, StreamFormat
from instruments.protocols.stream_formats.readings import Decoded, flags, step_of, whole_numbers

LONGEST_LINE = 1024


class _Not(Enum):
    """Why a line is no reading."""

    DAMAGED = 1
    OTHER_MESSAGE = 2


class LineDecoder:
    """Decodes the lines of a format. The first line after a drop is not used: it may have lost its beginning."""

    def __init__(self, format_: StreamFormat) -> None:
        assert format_.line is not None
        self._format, self._layout = format_, format_.line
        self._steps = [step_of(field) for field in self._layout.fields]
        self._unfinished, self._in_line = b"", False

    def drop(self) -> None:
        """Drop the unfinished line."""
        self._unfinished, self._in_line = b"", False

    def feed(self, data: bytes) -> Decoded:
        """Return the readings of every line that is whole now."""
        pieces, behind, self._unfinished = split_lines(self._unfinished + data, LONGEST_LINE)
        if pieces and not self._in_line:
            pieces, behind = pieces[1:], behind[1:]
            self._in_line = True
        parsed_lines = [self._numbers(piece) if piece else _Not.OTHER_MESSAGE for piece in pieces]
        rows = [parsed_line for parsed_line in parsed_lines if isinstance(parsed_line, list)]
        numbers = np.asarray(rows, dtype=np.float64).reshape(-1, len(self._layout.fields)).T
        good = np.ones(len(rows), dtype=bool)
        values = {}
        for field, column, step in zip(self._layout.fields, numbers, self._steps, strict=True):
            values[field.name], fits = whole_numbers(column, step)
            good &= fits
        after = behind[[isinstance(parsed_line, list) for parsed_line in parsed_lines]]
        return Decoded(values, flags(self._format, values, good), after, parsed_lines.count(_Not.DAMAGED))

    def _numbers(self, line: bytes) -> list[float] | _Not:
        """Return the numbers of the fields of one line, or why it has none."""
        if not line.isascii():
            return _Not.DAMAGED
        if (body := body_of(line, self._layout)) is None:
            return _Not.DAMAGED
        if not body.startswith(self._layout.begins):
            return _Not.OTHER_MESSAGE if body[:1] == self._layout.begins[:1] else _Not.DAMAGED
        separator = self._layout.separator
        words = body.split() if separator == " " else body.split(separator)
        if self._layout.columns is not None and len(words) != self._layout.columns:
            return _Not.DAMAGED
        try:
            numbers = [_number(words[field.column], field.prefix) for field in self._layout.fields]
        except (ValueError, IndexError):
            return _Not.DAMAGED
        unequal = any(
            field.equals is not None and field.equals != number
            for field, number in zip(self._layout.fields, numbers, strict=True)
        )
        return _Not.OTHER_MESSAGE if unequal else numbers


def _number(word: str, prefix: str) -> float:
    """Return the number behind a prefix; raises ValueError for another word."""
    if not prefix:
        return float(word)
    if not (stripped := word.strip()).startswith(prefix):
        raise ValueError(f"{word!r} does not begin with {prefix!r}")
    return float(stripped[len(prefix) :])


def body_of(line: bytes, layout: LineLayout) -> str | None:
    """Return the text of a line before its checksum; None where the checksum is wrong or missing."""
    if layout.checksum is None:
        return line.decode("ascii")
    body, mark, digits = line.rpartition(layout.checksum.mark.encode("ascii"))
    used = algorithm(layout.checksum.algorithm)
    if not mark or len(digits) != 2 * used.size:
        return None
    try:
        sent = int(digits, 16)
    except ValueError:
        return None
    return body.decode("ascii") if used.of(body[layout.checksum.start :]) == sent else None
