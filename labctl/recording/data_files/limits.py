"""How much one data file may hold: an import uses bounded memory, however large a file becomes when unpacked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from labctl.errors import BadRecording

#: Rows times columns of one file; each takes 8 bytes in memory, so 800 MB.
MAX_VALUES = 100_000_000
MAX_COLUMNS = 256
VALUE_BYTES = 8
#: Largest unpacked size of all pages of a file: its values with their dictionaries.
MAX_UNPACKED_BYTES = 2_000_000_000
#: Whole numbers up to here are exact in every reader of the answers: 2^53 - 1.
LARGEST_WHOLE = (1 << 53) - 1

_ADVICE = "divide the recording, or give points (one row per data set)"


class Space:
    """What the values of one file may still take, in bytes."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._left = MAX_VALUES * VALUE_BYTES

    def take(self, column: str, size: int) -> None:
        """Count `size` bytes of a column; raises BadRecording when the file has no room for them."""
        self._left -= size
        if self._left < 0:
            raise BadRecording(
                f"{self._path}: column {column[:80]!r}: the file's values take more than "
                f"{MAX_VALUES * VALUE_BYTES / 1e6:g} MB, the limit of one file; {_ADVICE}, or shorten its texts"
            )


def refuse_too_many(path: Path, rows: int, columns: int) -> None:
    """Raise BadRecording where a file has more values than are imported at once."""
    if rows * columns > MAX_VALUES:
        raise BadRecording(
            f"{path}: {rows} rows x {columns} columns = {rows * columns} values; at most {MAX_VALUES} are read from "
            f"one file; {_ADVICE}"
        )


def refuse_too_large(path: Path, size: int) -> None:
    """Raise BadRecording where the unpacked size, in bytes, is above the limit, as by long words or padding."""
    if size > MAX_UNPACKED_BYTES:
        raise BadRecording(
            f"{path}: has an unpacked size of {size / 1e6:g} MB; at most {MAX_UNPACKED_BYTES / 1e6:g} MB are read "
            "from "
            f"one file; {_ADVICE}, or shorten its texts"
        )


def checked_names(path: Path, names: Sequence[str]) -> None:
    """Raise BadRecording for columns that are too many, or of one name."""
    if len(names) > MAX_COLUMNS:
        raise BadRecording(
            f"{path}: {len(names)} columns, but at most {MAX_COLUMNS} are allowed; remove those that are not needed"
        )
    names_seen: set[str] = set()
    for name in names:
        if name in names_seen:
            raise BadRecording(f"{path}: column {name[:80]!r} is repeated in the header; remove or rename one")
        names_seen.add(name)
