"""Scatter of a magnetometer's distances where rests are known: noise of a reading, and errors of its places.

Of k rests and nine parameters the error of a place is known by few values, which the autocorrelation of the residuals
does not show: the parameters have taken most of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.magnetometer.places import Places, Weights
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import combined_freedom, scatter_by_variances

#: Where the ratios of the variances to that of a reading are searched, a logarithm, and where the search starts.
LOG_RATIO, START = (-18.0, 8.0), (-1.0, -1.0)
TOLERANCE = 1e-3


@dataclass(frozen=True)
class RestScatter:
    """Variances by the restricted likelihood, and what they make of a fit that weighs the readings by them."""

    variances: Array  #: (3,) of a reading, of a rest's error, of what a way adds, uT^2
    by_variance: NDArray[np.float64]  #: (3, 9, 9) derivatives of the parameters' covariance, the weights kept
    information: NDArray[np.float64]  #: (3, 3) on the variances

    @property
    def ratios(self) -> Array:
        """Variances of rests and ways over that of a reading, (2,)."""
        return np.asarray(self.variances[1:] / self.variances[0])

    def covariance(self, by_parameter: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance (q, q) of values whose derivative by the parameters is (q, 9)."""
        whole = np.tensordot(self.variances, self.by_variance, 1)
        return np.asarray(by_parameter @ whole @ by_parameter.T)

    def freedom(self, by_parameter: NDArray[np.float64]) -> Array:
        """Return the degrees of freedom (q,) of the standard uncertainties of such values."""
        slopes = np.einsum("qi,vij,qj->vq", by_parameter, self.by_variance, by_parameter)
        return combined_freedom(slopes.T @ self.variances, [], scatter_by_variances(slopes, self.information))


def scatter_of(jacobian: NDArray[np.float64], distance: Array, places: Places) -> RestScatter:
    """Return the scatter of distances (n,) with derivatives (n, 9) by the parameters.

    The variances are those of the largest restricted likelihood (Patterson and Thompson 1971): what the fit of the
    parameters takes of the residuals is not counted.
    """
    from scipy.optimize import minimize

    problem = _Problem.of(jacobian, distance, places)
    minimum = minimize(
        lambda logs: problem.negative_log_likelihood(np.exp(logs)), np.array(START), method="Powell",
        bounds=[LOG_RATIO] * 2, options={"xtol": TOLERANCE, "ftol": 1e-8},
    )  # fmt: skip
    return problem.scatter(np.exp(minimum.x))


@dataclass(frozen=True)
class _Problem:
    """What the likelihood needs: products of the columns (the derivatives, then the distances), whole and by place.

    The derivatives are J = Q R, of which Q is used: centre and matrix have units of very different sizes.
    """

    n: int
    triangle: NDArray[np.float64]  #: R (9, 9)
    whole: NDArray[np.float64]  #: (10, 10)
    sums: NDArray[np.float64]  #: (k, 10), as of `Weights`
    places: Places

    @staticmethod
    def of(jacobian: NDArray[np.float64], distance: Array, places: Places) -> _Problem:
        orthogonal, triangle = np.linalg.qr(jacobian)
        columns = np.column_stack([orthogonal, distance])
        none = Weights.of(places, np.zeros(2))
        return _Problem(len(columns), triangle, columns.T @ columns, none.sums(columns), places)

    def _white_var(self, normal: NDArray[np.float64]) -> float:
        """Return the variance of a reading, uT^2, that is likeliest, by columns^T V^-1 columns (10, 10)."""
        left = normal[-1, -1] - normal[-1, :-1] @ np.linalg.solve(normal[:-1, :-1], normal[:-1, -1])
        return float(left / (self.n - len(normal) + 1))

    def negative_log_likelihood(self, ratios: Array) -> float:
        """Return minus the logarithm of the restricted likelihood, without its constant."""
        weights = Weights.of(self.places, ratios)
        normal = weights.product_of(self.whole, self.sums)
        _, of_normal = np.linalg.slogdet(normal[:-1, :-1])
        of_white = (self.n - len(normal) + 1) * np.log(self._white_var(normal))
        return (weights.log_determinant + float(of_normal) + float(of_white)) / 2

    def scatter(self, ratios: Array) -> RestScatter:
        """Return the scatter by ratios (2,) of the variances.

        The information is tr(P D_i P D_j) / 2 with D_1 = 1 and D_i = Z S_i Z^T; as P V P = P, products of k places and
        nine columns are enough. The covariance is N^-1 J^T V^-1 (.) V^-1 J N^-1 with N = J^T V^-1 J.
        """
        weights, parts = Weights.of(self.places, ratios), self.places.parts
        normal = weights.product_of(self.whole, self.sums)
        inverse, white = np.linalg.inv(normal[:-1, :-1]), self._white_var(normal)
        root = weights.root
        weighed = root[:, None] * weights.solve(self.sums[:, :-1])  # Z^T V^-1 J
        across = root[:, None] * weights.solve(np.diag(root)) - weighed @ inverse @ weighed.T  # Z^T P Z
        times = np.array([part @ across for part in parts])
        shared = np.einsum("iab,jba->ij", times, times)
        trace = np.einsum("iaa->i", times)
        mixed = trace - shared @ ratios  # D_1 = V - sum of ratio D_i
        own = self.n - len(inverse) - trace @ ratios - mixed @ ratios
        information = np.block([[np.array([[own]]), mixed[None]], [mixed[:, None], shared]]) / 2
        back = np.linalg.inv(self.triangle)
        of_places = weighed @ inverse @ back.T
        by_place = np.array([of_places.T @ (part @ of_places) for part in parts])
        by_white = np.asarray(back @ inverse @ back.T - np.tensordot(ratios, by_place, 1), dtype=np.float64)
        return RestScatter(
            white * np.append(1.0, ratios), np.concatenate([[by_white], by_place]), information / white**2
        )
