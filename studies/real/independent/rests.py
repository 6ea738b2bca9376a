"""Rests in poses: where a unit was still, and what its accelerometer says of gravity there (Tedaldi et al. 2014)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from studies.real.independent.files import Array

WINDOW_S, SHORTEST_REST_S = 0.5, 1.0
#: A window is still where the gyro scatters by less than so many times what its quiet windows do.
TIMES_QUIET = 3.0


@dataclass(frozen=True)
class Session:
    """Readings of one unit: times (n,) s, outputs (n, 3) deg/s, specific force (n, 3) in any one unit."""

    t_s: Array
    rates: Array
    force: Array


def rests(session: Session) -> list[slice]:
    """Return the rests of a session, half a window shorter at both ends."""
    size = max(round(WINDOW_S / float(np.median(np.diff(session.t_s)))), 2)
    scatter = _scatter(np.hstack([session.rates, session.force]), size)
    quietest = np.argsort(scatter[:, :3].max(axis=1))[: len(scatter) // 5]
    still = (scatter < TIMES_QUIET * np.median(scatter[quietest], axis=0)).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    # a run of still windows from a to b holds readings a to b + size; half a window is left out at both ends
    found = [slice(a + size // 2, b + size // 2) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [part for part in found if part.stop - part.start >= (SHORTEST_REST_S / WINDOW_S - 1) * size]


def _scatter(values: Array, size: int) -> Array:
    """Return the standard deviation over every window of `size` readings, (n - size + 1, columns)."""
    centred = values - values.mean(axis=0)
    start = np.zeros((1, values.shape[1]))
    first, second = (np.concatenate([start, np.cumsum(power, axis=0)]) for power in (centred, centred**2))
    mean = (first[size:] - first[:-size]) / size
    return np.sqrt(np.maximum((second[size:] - second[:-size]) / size - mean**2, 0.0))


def gravity(session: Session, at: list[slice]) -> tuple[Array, Array, Array]:
    """Return the direction of gravity's reaction in each rest (m, 3), and the accelerometer's matrix and offset.

    direction = matrix @ (force - offset), of length 1 in every rest: nine parameters, the matrix upper triangular, so
    that z is the accelerometer's z axis and y lies in the plane of its y and z.
    """
    means = np.array([session.force[part].mean(axis=0) for part in at])
    scale = float(np.median(np.linalg.norm(means - (means.max(axis=0) + means.min(axis=0)) / 2, axis=1)))
    upper = np.triu_indices(3)

    def matrix_of(parameters: Array) -> Array:
        matrix = np.zeros((3, 3))
        matrix[upper] = parameters
        return matrix / scale

    def lengths(parameters: Array) -> Array:
        found = (means - scale * parameters[6:]) @ matrix_of(parameters[:6]).T
        return np.linalg.norm(found, axis=1) - 1.0

    centre = (means.max(axis=0) + means.min(axis=0)) / 2 / scale
    solved = least_squares(lengths, np.concatenate([np.eye(3)[upper], centre]), xtol=1e-14, ftol=1e-14).x
    matrix, offset = matrix_of(solved[:6]), scale * solved[6:]
    return (means - offset) @ matrix.T, matrix, offset


def moves(at: list[slice], session: Session, longest_s: float = 60.0) -> list[tuple[int, slice]]:
    """Return what lies between the middles of rests that follow each other, as (first rest, readings)."""
    found = []
    for number, (one, other) in enumerate(pairwise(at)):
        part = slice(one.stop - 1, other.start + 1)
        if session.t_s[part.stop - 1] - session.t_s[part.start] <= longest_s:
            found.append((number, part))
    return found
