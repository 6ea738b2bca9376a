"""Columns of positions: which body axis points up in each row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instruments.positions import AXES, EXPECTED, Position

__all__ = ["AXES", "EXPECTED", "Position", "axis_in", "up_in"]


def up_in(position: NDArray[np.generic], axis: str) -> NDArray[np.float64]:
    """Return how much of a body axis points up in each row, (n,): 1, -1 or 0, in a tilted mounting between them.

    Raises ValueError for a text that is no position.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    positions = [Position.of(text) for text in texts.tolist()]
    return np.array([each.up[AXES.index(axis)] for each in positions])[of]


def axis_in(position: NDArray[np.generic]) -> NDArray[np.str_]:
    """Return the body axis along the table axis in each row, (n,); empty in a tilted mounting.

    Raises ValueError like `up_in`.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    return np.array([Position.of(text).axis for text in texts.tolist()], dtype=np.str_)[of]
