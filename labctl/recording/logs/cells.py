"""The cells of one column of a text, as numbers or as words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from labctl.recording.raw_table import RawColumn

#: Cells that say that there is no number.
_MISSING = pa.array(["", "nan", "na", "n/a", "null", "none", "-nan"])
_NUMBER = r"^[+-]?([0-9]+([.][0-9]*)?|[.][0-9]+)([eE][+-]?[0-9]+)?$|^[+-]?(?i:inf|infinity)$"
#: Wrong cells that are remembered.
MOST_WRONG = 20
#: A column is of words where more than this share of its cells are no numbers.
WORDS = 0.5
LONGEST_WORD = 64


def column_of(name: str, pieces: Sequence[pa.Array], decimal: str, unit: str = "") -> RawColumn:
    """Return a column from its cells as text, piece by piece in the order of the file."""
    wrong: list[tuple[int, str]] = []
    numbers, n_wrong, row = [], 0, 0
    for piece in pieces:
        values, found, count = _numbers(piece, decimal)
        wrong += [(row + index + 1, text) for index, text in found[: MOST_WRONG - len(wrong)]]
        numbers.append(values)
        n_wrong += count
        row += len(piece)
    whole = np.concatenate(numbers) if numbers else np.zeros(0)
    filled = int(np.isfinite(whole).sum()) + n_wrong
    if n_wrong > WORDS * filled:
        return RawColumn(name, whole, words=_words(pieces), unit=unit)
    return RawColumn(name, whole, unit=unit, wrong=tuple(wrong), n_wrong=n_wrong)


def _numbers(piece: pa.Array, decimal: str) -> tuple[Any, list[tuple[int, str]], int]:
    """Return the numbers of a piece, (n,), nan where there is none, the first wrong cells, and the number of all."""
    if decimal == ".":
        try:
            return np.asarray(piece.cast(pa.float64())), [], 0
        except pa.ArrowInvalid:
            pass
    text = pc.utf8_trim_whitespace(piece)
    if decimal == ",":
        text = pc.replace_substring(text, ",", ".")
    missing = pc.is_in(pc.utf8_lower(text), _MISSING)
    number = pc.match_substring_regex(text, _NUMBER)
    values = pc.if_else(number, text, "nan").cast(pa.float64())
    bad = np.flatnonzero(~np.asarray(pc.or_(number, missing)))
    return np.asarray(values), [(int(row), piece[int(row)].as_py()) for row in bad[:MOST_WRONG]], len(bad)


def _words(pieces: Sequence[pa.Array]) -> np.ndarray[Any, np.dtype[np.str_]]:
    parts = []
    for piece in pieces:
        coded = pc.utf8_slice_codeunits(pc.utf8_trim_whitespace(piece), 0, LONGEST_WORD).dictionary_encode()
        parts.append(np.array(coded.dictionary.to_pylist(), dtype=np.str_)[np.asarray(coded.indices)])
    return np.concatenate(parts)
