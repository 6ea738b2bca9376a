"""What is known of coefficients before a fit, as rows below the whitened data.

Such a row is no measurement of the recording: neither the drift between data sets nor a noise that grows with the rate
is in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array, block_diagonal


@dataclass(frozen=True)
class PriorRows:
    """Rows (q, k) on k coefficients and their values (q,), each with a standard uncertainty of 1."""

    rows: NDArray[np.float64]
    values: Array

    @classmethod
    def none(cls, coefficients: int) -> PriorRows:
        """Nothing is known of so many coefficients."""
        return cls(np.zeros((0, coefficients)), np.zeros(0))

    def __len__(self) -> int:
        return len(self.values)

    def plus(self, rows: NDArray[np.float64], values: Array) -> PriorRows:
        """Return these and further rows (r, c) with values (r,), on the first c coefficients."""
        below = np.zeros((len(rows), self.rows.shape[1]))
        below[:, : rows.shape[1]] = rows
        return PriorRows(np.vstack([self.rows, below]), np.concatenate([self.values, values]))

    def with_coefficients(self, u: Array) -> PriorRows:
        """Return these with further coefficients (e,), each 0 with a standard uncertainty (e,); inf: it is free."""
        each = np.diag(1.0 / u)[np.isfinite(u)]
        return PriorRows(block_diagonal([self.rows, each]), np.concatenate([self.values, np.zeros(len(each))]))

    def below(self, whitened: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return whitened columns and data (..., m, k + 1) with these rows below, (..., m + q, k + 1)."""
        if not len(self):
            return whitened
        own = np.column_stack([self.rows, self.values])
        return np.concatenate([whitened, np.broadcast_to(own, (*whitened.shape[:-2], *own.shape))], axis=-2)
