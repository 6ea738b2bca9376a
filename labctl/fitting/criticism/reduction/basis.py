"""Orthonormal functions of the readings within a data set."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Time constant of the start transient's function, s.
START_TAU_S = 4.0
#: Waves per turn of the table: once, twice, and the reduction gear's.
WAVES = (1, 2, 4)
#: Lines of the stepper's electrical cycle per turn, with and without the reduction gear. They are far larger than what
#: is searched for: they are removed from every other coordinate, and not kept themselves.
STEP_LINES = (200, 50)
#: A line that sampling folds onto a constant by more than this share cannot be distinguished from one, and is not
#: removed.
STEADY = 0.3
#: A function of which less than this share is independent of those before it is left out: slow rates turn only degrees.
MIN_INDEPENDENT_SHARE = 0.1


def orthonormal_basis(
    presence: NDArray[np.float64], since: NDArray[np.float64], turn_rad: NDArray[np.float64],
    angle: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:  # fmt: skip
    """Return orthonormal functions, (R, m, n), and which exist in which data set, (R, m).

    By Gram-Schmidt, twice (Kahan), over readings (m, n): `presence` is 1 where there is one, `since` the time in its
    data set in s, `turn_rad` the angle that the table turned and `angle` where it stands (None: not recorded), rad.
    """
    basis_functions = [presence, since, np.exp(-since / START_TAU_S)]
    lines = [wave(k * turn_rad) for k in STEP_LINES for wave in (np.cos, np.sin)]
    if angle is not None:
        basis_functions += [wave(k * angle) for k in WAVES for wave in (np.cos, np.sin)]
    functions = [*lines, *basis_functions]
    basis = np.zeros((len(functions), *presence.shape))
    present = np.zeros((len(functions), len(presence)), dtype=bool)
    count = np.maximum(presence.sum(axis=1), 1.0)
    for k, function in enumerate(functions):
        values = function * presence
        size = np.sqrt((values**2).sum(axis=1))
        steady = np.abs(values.sum(axis=1)) / np.maximum(size * np.sqrt(count), 1e-300)
        for _ in range(2):
            inner = np.einsum("rmn,mn->rm", basis[:k], values)
            values = values - np.einsum("rm,rmn->mn", inner, basis[:k])
        norm = np.sqrt((values**2).sum(axis=1))
        present[k] = norm > np.maximum(MIN_INDEPENDENT_SHARE * size, 1e-9)
        if k < len(lines):
            present[k] &= steady < STEADY
        basis[k] = np.where(present[k][:, None], values / np.maximum(norm, 1e-300)[:, None], 0.0)
    return basis[len(lines) :], present[len(lines) :]
