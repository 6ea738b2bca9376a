"""The ellipsoid on which the readings of a magnetometer lie while it turns in a constant field.

A reading is m = b + S^-1 h + noise: b hard iron, S soft iron with the scale factors, |h| = F constant. So
|A (m - b)| = 1 with A = S / F. Which rotation S contains no turn can tell from the size of the field: S is taken as
symmetric. The start is the algebraic fit of a quadric; the nine parameters are those with the least distances from the
ellipsoid, to first order (Sampson 1982). Noise lengthens a vector by its part square to it, which is taken off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

PARAMETERS = 9
#: Places of the symmetric matrix in the order of its parameters.
PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
#: Rounds of Gauss and Newton, and the change of the parameters, in their own uncertainty, that ends them.
ROUNDS, CONVERGED = 50, 1e-6
#: A system of normal equations in scaled columns is singular beyond this condition of its columns.
LARGEST_CONDITION = 1e6
#: Returns columns^T V^-1 columns (p, p) of columns (n, p), V the covariance of the distances but for a factor.
Product = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Ellipsoid:
    """Centre b (3,), uT, and matrix A (3, 3), 1/uT, with what the readings are away from it."""

    centre: Array
    matrix: NDArray[np.float64]
    jacobian: NDArray[np.float64]  #: (n, 9) of the distances by the centre and the matrix in the order of PLACES
    distance: Array  #: (n,) uT, positive outside

    @property
    def parameters(self) -> Array:
        return np.concatenate([self.centre, [self.matrix[place] for place in PLACES]])

    @property
    def noise(self) -> float:
        """Standard deviation of a distance, uT."""
        return float(np.sqrt(self.distance @ self.distance / max(len(self.distance) - PARAMETERS, 1)))


def quadric(readings: NDArray[np.float64]) -> tuple[Array, NDArray[np.float64]] | None:
    """Return centre and matrix of the quadric through readings (n, 3) by linear least squares; None: no ellipsoid."""
    origin, size = readings.mean(axis=0), float(readings.std())
    if not size > 0:
        return None
    x, y, z = ((readings - origin) / size).T
    columns = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z])
    solution, _, rank, _ = np.linalg.lstsq(columns, np.ones(len(readings)), rcond=1e-8)
    if rank < PARAMETERS:
        return None
    square = _symmetric(np.asarray(solution[:6], dtype=np.float64))
    values = np.linalg.eigvalsh(square)
    if np.any(values == 0) or values[0] * values[-1] < 0:
        return None
    centre = -np.linalg.solve(square, solution[6:])
    level = 1 + centre @ square @ centre
    values, vectors = np.linalg.eigh(square / level)
    if not np.all(values > 0):
        return None
    return origin + size * centre, vectors * np.sqrt(values) @ vectors.T / size


def unweighed(columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return columns^T columns (p, p) of columns (n, p): the product by which all rows weigh alike."""
    return np.asarray(columns.T @ columns)


def nearest_ellipsoid(
    readings: NDArray[np.float64], centre: Array, matrix: NDArray[np.float64],
    product: Product = unweighed,
) -> Ellipsoid | None:  # fmt: skip
    """Return the ellipsoid with the least squared distances from readings (n, 3), from a start; None: undetermined.

    `product` weighs them.
    """
    best = at(readings, centre, matrix, 0.0)
    for _ in range(ROUNDS):
        normal = product(np.column_stack([best.jacobian, best.distance]))
        length = np.sqrt(np.diag(normal)[:-1])
        scaled = normal[:-1, :-1] / np.outer(length, length)
        if not np.linalg.cond(scaled) < LARGEST_CONDITION**2:
            return None
        step = -np.linalg.solve(scaled, normal[:-1, -1] / length) / length
        noise = np.sqrt(normal[-1, -1] / max(len(readings) - PARAMETERS, 1))
        u = noise * np.sqrt(np.diag(np.linalg.inv(scaled))) / length
        moved_parameters = best.parameters + step
        matrix = _symmetric(moved_parameters[3:])
        if not np.all(np.linalg.eigvalsh(matrix) > 0):
            return None
        best = at(readings, moved_parameters[:3], matrix, best.noise)
        if np.all(np.abs(step) <= CONVERGED * u):
            return best
    return None


def at(readings: NDArray[np.float64], centre: Array, matrix: NDArray[np.float64], noise: float) -> Ellipsoid:
    """Return an ellipsoid with the distances of readings (n, 3) that have noise, uT, in each component."""
    from_centre = readings - centre
    inside = from_centre @ matrix
    size = np.linalg.norm(inside, axis=1)
    along = inside / size[:, None]
    pull = along @ matrix
    slope = np.linalg.norm(pull, axis=1)
    longer = noise**2 * (np.sum(matrix**2) - slope**2) / 2
    foot = from_centre / size[:, None]  # on the ellipsoid: the derivatives do not contain the distance's own noise
    columns = [along[:, i] * foot[:, j] + (along[:, j] * foot[:, i] if i != j else 0.0) for i, j in PLACES]
    jacobian = np.column_stack([-pull, *columns]) / slope[:, None]
    return Ellipsoid(centre, matrix, jacobian, (size - 1 - longer) / slope)


def _symmetric(parameters: Array) -> NDArray[np.float64]:
    matrix = np.zeros((3, 3))
    for value, (i, j) in zip(parameters, PLACES, strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix
