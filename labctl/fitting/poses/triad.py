"""Three axes with scale factors, misalignments and biases: reading = bias + (I + E) true value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: The errors of the three axes of an accelerometer that gravity determines: its z axis is the body's z axis, its y axis
#: lies in the y-z plane of the body. The other three are a rotation of the body axes, which rests do not determine.
UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def corrected(readings: NDArray[np.float64], errors: NDArray[np.float64], bias: Array) -> NDArray[np.float64]:
    """Return the true values (n, 3) of readings (n, 3) of axes with errors (3, 3) and bias (3,)."""
    return np.asarray(np.linalg.solve(np.eye(3) + errors, (readings - bias).T).T, dtype=np.float64)


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the directions of vectors (n, 3)."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None], dtype=np.float64)


def cross_matrix(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrices (n, 3, 3) that multiply from the left like the cross product by vectors (n, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def tangents(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return two unit vectors perpendicular to each direction (n, 3) and to each other, (n, 2, 3)."""
    least = np.argmin(np.abs(directions), axis=1)
    first = unit(np.cross(directions, np.eye(3)[least]))
    return np.stack([first, np.cross(directions, first)], axis=1)
