"""Least squares in which a few parameters are nonlinear: the linear ones are projected out (Golub and Pereyra 1973).

The steps are Gauss and Newton's with the Jacobian of Kaufman (1975), shortened until they leave less.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Longest step of a parameter, and the share of the curvature that is added to it.
LONGEST, DAMPED = 0.5, 1e-4
#: A step is halved so often; a fit is done where a step gains less than this share.
HALVINGS, DONE = 4, 1e-5


class Local:
    """A part of the data at one set of parameters, over its noise.

    `rows` (n, .) are columns that do not depend on the parameters, `own` columns that do, the derivatives of these
    along each parameter in turn, and what is to be explained.
    """

    def __init__(self, rows: NDArray[np.float64], base: int, shaped: int) -> None:
        whole, y = rows[:, : base + shaped], rows[:, -1]
        size = np.maximum(np.linalg.norm(whole, axis=0), 1e-300)
        directions, sizes, others = np.linalg.svd(whole / size, full_matrices=False)
        is_estimable = sizes > 1e-9 * sizes[0]
        directions, inner = directions[:, is_estimable], others[is_estimable].T / sizes[is_estimable]
        values = (inner @ (directions.T @ y)) / size
        moved = rows[:, base + shaped : -1].reshape(len(rows), -1, shaped) @ values[base:]
        #: What is left, (n,), and what each parameter moves beside the linear ones, (n, parameters).
        self.residual = y - directions @ (directions.T @ y)
        self.slopes = moved - directions @ (directions.T @ moved)

    @property
    def chi2(self) -> float:
        """The sum of squares that is left."""
        return float(self.residual @ self.residual)


def refined(
    at: Callable[[Array], Sequence[Local]], begin: Array, bounds: tuple[float, float], most_steps: int
) -> Array:  # fmt: skip
    """Return the parameters (p,) at which the parts of the data leave least, all within the same bounds."""
    point, parts = begin, at(begin)
    chi2 = sum(part.chi2 for part in parts)
    for _ in range(most_steps):
        curvature = sum((part.slopes.T @ part.slopes for part in parts), np.zeros((len(point), len(point))))
        pull = sum((part.slopes.T @ part.residual for part in parts), np.zeros(len(point)))
        curvature = curvature + np.diag(DAMPED * np.diag(curvature) + 1e-12)
        step = np.linalg.solve(curvature, pull)
        step *= min(1.0, LONGEST / max(float(np.max(np.abs(step))), 1e-300))
        for _ in range(HALVINGS):
            next_point = np.clip(point + step, *bounds)
            tried = at(next_point)
            less = sum(part.chi2 for part in tried)
            if less < chi2:
                break
            step = step / 2
        else:
            break
        gained, point, parts, chi2 = chi2 - less, next_point, tried, less
        if gained < DONE * chi2:
            break
    return point
