"""The array type of the numerical code."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: Double-precision array; the shape and the unit stand in the docstring of each function that takes or returns one.
Array = NDArray[np.float64]
#: A ratio to a noise floor ends here: readings without scatter leave no floor, and anything is infinitely above it.
MAX_OVER = 1e6


def over(values: Array, floor: Array) -> Array:
    """Return values in units of a noise floor, (n,), within -1e6 to 1e6; nothing above a floor of nothing is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.clip(np.where((values == 0) & (floor == 0), 0.0, values / floor), -MAX_OVER, MAX_OVER)


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Return a matrix with these, (r, c) each, along its diagonal; without a block it is (0, 0).

    `scipy.linalg.block_diag` takes a millisecond for ten small blocks, this a fiftieth of it; a fit asks often.
    """
    stacked = np.zeros((sum(len(block) for block in blocks), sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        stacked[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return stacked
