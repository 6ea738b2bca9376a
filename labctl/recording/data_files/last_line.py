"""The end of a text file: whether it was cut off within its last line."""

from __future__ import annotations

import re
from pathlib import Path

from labctl.recording.unread import Unread

#: A last column of anything else may have any length.
_NUMBER = re.compile(r"[-+]?[0-9]*[.,]?[0-9]*([eE][-+]?[0-9]*)?")
#: What is read of the end of a file, bytes, and the least lines in it that a last line is compared with.
TAIL_BYTES, MIN_LINES = 1 << 16, 20


def cut_last_line(path: Path, encoding: str, separator: str) -> Unread | None:
    """Return the last line of a file as unread where it was cut off; None where it is whole.

    A line was cut off where no line break ends it although others have one, and it has fewer columns than those, or a
    last column of a number with fewer characters than any of them.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, size - TAIL_BYTES))
        tail = file.read()
    text = tail.decode("utf-16" if encoding == "utf-16" and len(tail) == size else encoding, errors="replace")
    *lines, last = text.splitlines(keepends=True) or [""]
    before = [line.rstrip("\r\n") for line in lines[1:] if line.strip()]
    if last.endswith(("\n", "\r")) or not last.strip() or len(before) < MIN_LINES:
        return None
    fields = _fields(last, separator)
    others = [_fields(line, separator) for line in before]
    shortest = min(len(other[-1]) for other in others)
    if len(fields) == len(others[-1]) and (len(fields[-1]) >= shortest or not all(map(_is_number, [fields, *others]))):
        return None
    reason = f"the last line has no line break and ends after {last[-20:]!r} (byte {size})"
    return Unread(len(last) / max(size, 1), (reason,), is_cut=True)


def _is_number(fields: list[str]) -> bool:
    return _NUMBER.fullmatch(fields[-1].strip()) is not None


def _fields(line: str, separator: str) -> list[str]:
    return line.split() if separator == " " else line.split(separator)
