"""A source of error that all data, or all of a data set, have in common: its part of the coefficients' covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from labctl.answers.fitted_model import ErrorPartJson


@dataclass(frozen=True, eq=False)
class ErrorPart:
    """What errors of one source do to the coefficients of an axis; it is in their covariance.

    The errors are independent, one in each column, and the columns are the same errors in each axis of a fit.
    """

    source: str
    u: float  #: standard uncertainty of one error, the root mean square of all, in `unit`
    unit: str
    root: NDArray[np.float64]  #: (k*m, j) change of the coefficients by one standard uncertainty of each error

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Its part of the covariance, (k*m, k*m)."""
        return np.asarray(self.root @ self.root.T)

    def take(self, rows: NDArray[np.int64]) -> ErrorPart:
        """Return the part of some coefficients."""
        return replace(self, root=self.root[rows])

    def to_json(self) -> ErrorPartJson:
        """Return it as JSON."""
        return {"source": self.source, "u": self.u, "unit": self.unit, "root": self.root.tolist()}

    @staticmethod
    def from_json(record: ErrorPartJson) -> ErrorPart:
        """Return what `to_json` described."""
        root = np.asarray(record["root"], dtype=np.float64)
        return ErrorPart(record["source"], record["u"], record["unit"], root)
