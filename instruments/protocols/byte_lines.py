"""Lines of a stream of bytes, and how many bytes arrived after each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def split_lines(data: bytes, longest: int) -> tuple[list[bytes], NDArray[np.int64], bytes]:
    """Return the lines of `data` without their ends (LF, CR LF), how many bytes follow each (n,), and the rest.

    The rest is the unfinished line at the end, of which at most `longest` bytes are kept.
    """
    pieces = data.split(b"\n")
    rest = pieces.pop()
    ends = np.cumsum([len(piece) + 1 for piece in pieces], dtype=np.int64)
    return [piece.strip(b"\r") for piece in pieces], len(data) - ends, rest[-longest:]
