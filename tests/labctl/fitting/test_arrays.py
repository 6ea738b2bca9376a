"""Matrices that are put together from blocks."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from labctl.fitting.numeric.arrays import block_diagonal


def test_blocks_stand_along_the_diagonal_as_in_scipy() -> None:
    """A block without columns takes its rows too: those of a coefficient that is not estimated."""
    blocks = [np.arange(6.0).reshape(2, 3), np.zeros((2, 0)), np.eye(2), np.full((1, 1), 7.0)]
    np.testing.assert_array_equal(block_diagonal(blocks), block_diag(*blocks))
    assert block_diagonal([]).shape == (0, 0)
