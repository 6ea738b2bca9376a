"""Scatter of a magnetometer's distances where rests are known: noise of a reading, and one error of each rest.

While a unit lies still, its place does not change, and neither does what iron or currents near it add to the field: all
readings of a rest share one error, however many they are. Of k rests and nine parameters that error is known by fewer
than k values, which the autocorrelation of the residuals does not show: the parameters have taken most of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.freedom import combined_freedom, scatter_by_variances

#: Where the ratio of the two variances is looked for, a logarithm.
LOG_RATIO = (-18.0, 8.0)
TOLERANCE = 1e-4


@dataclass(frozen=True)
class RestScatter:
    """Variances of the readings and of the rests by the restricted likelihood, and what they make of a fit."""

    white_var: float  #: of a reading, uT^2
    place_var: float  #: shared by the readings of a rest, uT^2
    by_reading: NDArray[np.float64]  #: (9, 9) covariance of the parameters by readings of variance 1
    by_rest: NDArray[np.float64]  #: (9, 9) by rests of variance 1
    information: NDArray[np.float64]  #: (2, 2) on the two variances

    def covariance(self, by_parameter: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance (q, q) of values whose derivative by the parameters is (q, 9)."""
        whole = self.white_var * self.by_reading + self.place_var * self.by_rest
        return np.asarray(by_parameter @ whole @ by_parameter.T)

    def freedom(self, by_parameter: NDArray[np.float64]) -> Array:
        """Return the degrees of freedom (q,) of the standard uncertainties of such values."""
        slopes = np.array([
            np.einsum("qi,ij,qj->q", by_parameter, each, by_parameter) for each in (self.by_reading, self.by_rest)
        ])  # fmt: skip
        variance = slopes.T @ np.array([self.white_var, self.place_var])
        return combined_freedom(variance, [], scatter_by_variances(slopes, self.information))


def scatter_of(jacobian: NDArray[np.float64], distance: Array, rest: NDArray[np.int64]) -> RestScatter:
    """Return the scatter of distances (n,) with derivatives (n, 9); `rest` (n,) is 0 for a reading between rests.

    The variances are those of the largest restricted likelihood (Patterson and Thompson 1971): what the fit of the
    parameters takes of the residuals is not counted.
    """
    from scipy.optimize import minimize_scalar

    problem = _Problem.of(jacobian, distance, rest)
    found = minimize_scalar(problem.unlikely, bounds=LOG_RATIO, method="bounded", options={"xatol": TOLERANCE})
    ratio = float(np.exp(found.x))
    white = problem.white_var(ratio)
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    of_rests = problem.sums[:, :-1] @ inverse
    by_reading, by_rest = (np.asarray(each, dtype=np.float64) for each in (inverse, of_rests.T @ of_rests))
    return RestScatter(white, ratio * white, by_reading, by_rest, problem.information(ratio) / white**2)


@dataclass(frozen=True)
class _Problem:
    """What the likelihood needs: products of the columns (the derivatives, then the distances), whole and by rest."""

    n: int
    whole: NDArray[np.float64]  #: (10, 10)
    sums: NDArray[np.float64]  #: (k, 10) of each rest
    count: Array  #: (k,) readings of each rest

    @staticmethod
    def of(jacobian: NDArray[np.float64], distance: Array, rest: NDArray[np.int64]) -> _Problem:
        columns = np.column_stack([jacobian, distance])
        _, place = np.unique(rest, return_inverse=True)
        sums = np.array([np.bincount(place, column) for column in columns.T], dtype=np.float64).T
        kept = np.unique(rest) > 0
        return _Problem(len(columns), columns.T @ columns, sums[kept], np.bincount(place)[kept].astype(np.float64))

    def _normal(self, ratio: float) -> NDArray[np.float64]:
        """Return columns^T V^-1 columns (10, 10) for V = 1 + ratio times the same of each rest (Woodbury)."""
        taken = ratio / (1 + ratio * self.count)
        return np.asarray(self.whole - (self.sums.T * taken) @ self.sums)

    def white_var(self, ratio: float) -> float:
        """Return the variance of a reading, uT^2, that is likeliest at a ratio of the variances."""
        normal = self._normal(ratio)
        left = normal[-1, -1] - normal[-1, :-1] @ np.linalg.solve(normal[:-1, :-1], normal[:-1, -1])
        return float(left / (self.n - len(normal) + 1))

    def unlikely(self, log_ratio: float) -> float:
        """Return minus the logarithm of the restricted likelihood, without its constant."""
        ratio = float(np.exp(log_ratio))
        normal = self._normal(ratio)
        _, of_normal = np.linalg.slogdet(normal[:-1, :-1])
        of_noise = float(np.sum(np.log1p(ratio * self.count)))
        return (of_noise + float(of_normal) + (self.n - len(normal) + 1) * np.log(self.white_var(ratio))) / 2

    def information(self, ratio: float) -> NDArray[np.float64]:
        """Return the information (2, 2) on both variances in units of the first one to the power -2.

        tr(P D_i P D_j) / 2 with D_1 = 1 and D_2 = Z Z^T, Z (n, k) the rest of each reading; as P V P = P, products
        of k rests and nine columns are enough.
        """
        count, sums = self.count, self.sums[:, :-1]
        inverse = np.linalg.inv(self._normal(ratio)[:-1, :-1])
        share = 1 / (1 + ratio * count)
        # Z^T P Z, and the same with one more P between
        across = np.diag(count * share) - (share[:, None] * sums) @ inverse @ (sums.T * share)
        # ratio times D_2 = V - D_1, and P V P = P
        of_rests = float(np.sum(across**2))
        trace = float(np.trace(across))
        total = self.n - len(inverse)
        mixed = trace - ratio * of_rests
        white = float(total - ratio * trace) - ratio * mixed
        return np.array([[white, mixed], [mixed, of_rests]]) / 2
