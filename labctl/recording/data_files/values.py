"""The values of one column, taken in piece by piece: numbers, whole numbers or words, as the format says."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.columns import BY_NAME
from labctl.recording.data_files.limits import LARGEST_WHOLE, Space

#: A character of numpy's text takes this many bytes.
CHARACTER_BYTES = 4


class ColumnValues:
    """Pieces of one column in the order of the file; `whole` returns them as one array.

    Raises BadRecording naming file, column and row (1 is the first row below the header).
    """

    def __init__(self, path: Path, name: str, space: Space) -> None:
        self.path, self.name, self.space = path, name, space
        self.kind = BY_NAME[name].kind if name in BY_NAME else None
        self.rows = 0
        self._longest = 0
        self._parts: list[Any] = []

    def add(self, piece: pa.Array) -> None:
        """Take in the values of some further rows."""
        if pa.types.is_dictionary(piece.type) and not holds_words(piece.type):
            piece = piece.dictionary_decode()
        if self.kind == "text":
            self._parts.append(self._words(piece))
        elif holds_words(piece.type):
            self._add_text(piece)
        elif self.kind == "integer":
            self._parts.append(self._integers(piece))
        else:
            self._parts.append(_floats(piece))
        self.rows += len(piece)

    def whole(self) -> NDArray[np.generic]:
        """Return all values, (rows,): text, int64 for whole numbers, else float64. Nothing is kept here."""
        parts, self._parts = self._parts, []
        if parts and isinstance(parts[0], pa.Array):  # an extra column, as text until all of it is known
            self.rows = 0
            try:
                parts = [self._numbers(part) for part in parts]
            except pa.ArrowInvalid:
                parts = [self._words(pc.utf8_trim_whitespace(part)) for part in parts]
        return np.concatenate(parts)

    def _add_text(self, piece: pa.Array) -> None:
        text = self._readable(piece)
        if pa.types.is_dictionary(text.type):
            self.space.take(self.name, self._wide(text.dictionary) * len(text))
            text = text.dictionary_decode()
        if self.kind is None:
            self.space.take(self.name, text.nbytes)
            self._parts.append(text)
            return
        try:
            self._parts.append(self._numbers(text))
        except pa.ArrowInvalid:
            self._refuse_text(text)

    def _numbers(self, text: pa.Array) -> NDArray[np.generic]:
        """Return numbers written as text; raises ArrowInvalid where one is none."""
        with contextlib.suppress(pa.ArrowInvalid):  # 1.0 and 1e3 are whole numbers too, and no number may be empty
            return self._within(np.asarray(text.cast(pa.int64()))) if self.kind == "integer" else _floats(text)
        values = _floats(_nan_where_empty(text).cast(pa.float64()))
        return self._whole(values) if self.kind == "integer" else values

    def _words(self, piece: pa.Array) -> NDArray[np.generic]:
        text = piece if pa.types.is_dictionary(piece.type) else piece.cast(pa.string()).dictionary_encode()
        text = self._readable(text)
        width = self._wide(text.dictionary)
        rows = self.rows + len(text)
        self.space.take(self.name, max(width, self._longest) * rows - self._longest * self.rows)
        self._longest = max(width, self._longest)
        words = np.array([*text.dictionary.to_pylist(), ""], dtype=np.str_)
        return words[np.asarray(pc.fill_null(text.indices, len(words) - 1))]

    def _wide(self, words: pa.Array) -> int:
        """Return the bytes per row of a text column whose longest word is among these."""
        return CHARACTER_BYTES * int(pc.max(pc.utf8_length(words.cast(pa.large_string()))).as_py() or 1)

    def _readable(self, text: pa.Array) -> pa.Array:
        try:
            text.validate(full=True)
        except pa.ArrowInvalid as error:
            raise self._wrong(0, f"not UTF-8 text ({str(error).splitlines()[0]})", within=len(text)) from None
        return text

    def _integers(self, piece: pa.Array) -> NDArray[np.int64]:
        if piece.null_count:
            raise self._wrong(int(np.argmax(np.asarray(piece.is_null()))), "empty (expected a whole number)")
        if not pa.types.is_integer(piece.type):
            return self._whole(_floats(piece))
        return self._within(np.asarray(piece))

    def _whole(self, values: NDArray[np.float64]) -> NDArray[np.int64]:
        bad = ~np.isfinite(values) | (values != np.round(values))
        if bad.any():
            row = int(np.argmax(bad))
            raise self._wrong(row, f"{values[row]:g} is not a whole number")
        return self._within(values)

    def _within(self, values: NDArray[np.number]) -> NDArray[np.int64]:
        """Return whole numbers as int64; raises BadRecording where one is so large that two could become one."""
        bad = (values > LARGEST_WHOLE) | (values < -LARGEST_WHOLE)
        if bad.any():
            row = int(np.argmax(bad))
            value_text = f"{values[row]:d}" if values.dtype.kind in "iu" else repr(float(values[row]))
            raise self._wrong(
                row,
                f"{value_text} is beyond +-{LARGEST_WHOLE} (2^53 - 1), the largest whole number that is stored "
                "exactly; count from 1",
            )
        return values.astype(np.int64)

    def _refuse_text(self, text: pa.Array) -> None:
        column = BY_NAME[self.name]
        expected = f"{column.meaning}, {column.unit}" if column.unit else column.meaning
        for row, word in enumerate(_nan_where_empty(text).to_pylist()):
            try:
                float(word)
            except ValueError:
                hint = "; write a decimal point, not a comma" if "," in word else ""
                raise self._wrong(row, f"{word[:80]!r} is not a number (expected {expected}){hint}") from None

    def _wrong(self, row: int, text: str, *, within: int = 1) -> BadRecording:
        """Return the complaint about a row of the present piece, or about one of the `within` rows that begin there."""
        first = self.rows + row + 1
        rows = f"row {first}" if within == 1 else f"rows {first} to {first + within - 1}"
        return BadRecording(f"{self.path}: column {self.name[:80]!r}, {rows}: {text}")


def holds_words(kind: pa.DataType) -> bool:
    """Whether values of a type are words, also where a dictionary stands for them."""
    kind = kind.value_type if pa.types.is_dictionary(kind) else kind
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind))


def _floats(piece: pa.Array) -> NDArray[np.float64]:
    numbers = piece.cast(pa.float64())
    return np.asarray(pc.fill_null(numbers, float("nan")) if numbers.null_count else numbers, dtype=np.float64)


def _nan_where_empty(text: pa.Array) -> pa.Array:
    text = pc.fill_null(pc.utf8_trim_whitespace(text.cast(pa.string())), "")
    return pc.if_else(pc.or_(pc.equal(text, ""), pc.equal(pc.utf8_lower(text), "nan")), "nan", text)
