"""Whether the moves determine the nine coefficients of the gyro, and which turns are missing where they do not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.equations import Equations
from labctl.fitting.poses.moves import Moves
from labctl.fitting.poses.readings import AXES

#: Moves that nine coefficients take at least: two equations each, and some must be left to tell how well they fit.
MIN_MOVES = 9
#: A coefficient that the moves leave less certain than this is not determined.
LARGEST_U = 0.03
#: Moves that turn about an axis by less than this in all show nothing of it, deg.
MIN_TURN_DEG = 90.0
#: The condition above which the normal equations in scaled columns lose their meaning.
LARGEST_CONDITION = 1e5


def require_moves(serial: str, moves: Moves) -> None:
    """Raise NotEnoughData where fewer moves can be used than nine coefficients take, with why the others cannot."""
    usable = int(np.count_nonzero(moves.usable))
    if usable >= MIN_MOVES:
        return
    reasons = "; ".join(sorted({reason for reason in moves.why_not if reason}))
    raise NotEnoughData(
        f"{serial}: {usable} turns between rests can be used; nine coefficients of the gyro need at least {MIN_MOVES}"
        f"{f' ({len(moves) - usable} cannot: {reasons[:200]})' if reasons else ''}: turn the unit by 90 deg or more "
        "from "
        "rest to rest, about each axis, both ways"
    )


def require_rests(serial: str, rests: int) -> None:
    """Raise NotEnoughData for fewer rests than MIN_MOVES turns between them take."""
    if rests <= MIN_MOVES:
        raise NotEnoughData(
            f"{serial}: {rests} rests have {max(rests - 1, 0)} turns between them; nine coefficients of the gyro need "
            f"at least {MIN_MOVES}: turn the unit by 90 deg or more from rest to rest, about each axis, both ways"
        )


def condition_of(jacobian: NDArray[np.float64], covariance: NDArray[np.float64]) -> float:
    """Return the condition of the nine columns (2m, 9), whitened and scaled to unit length."""
    white = np.linalg.solve(np.linalg.cholesky(covariance), jacobian)
    norms = np.linalg.norm(white, axis=0)
    singular = np.linalg.svd(white / np.where(norms > 0, norms, 1.0), compute_uv=False)
    return float(singular[0] / singular[-1]) if singular[-1] > 0 else float("inf")


def require_determined(serial: str, moves: Moves, equations: Equations, noise: NDArray[np.float64]) -> None:
    """Raise NotEnoughData where a coefficient is less certain than LARGEST_U, naming the turns that would tell it.

    `noise` (2m, 2m) is the covariance of the equations, rad^2.
    """
    white = np.linalg.solve(np.linalg.cholesky(noise), equations.jacobian)
    # each coefficient has a prior standard deviation of 0.5: one that no move shows keeps it, and no matrix is singular
    u = np.sqrt(np.diag(np.linalg.inv(white.T @ white + np.eye(9) / 0.5**2))).reshape(3, 3)
    if float(u.max()) <= LARGEST_U and condition_of(equations.jacobian, noise) <= LARGEST_CONDITION:
        return
    angle_deg = turned_deg(moves)
    column = int(np.argmin(angle_deg)) if angle_deg.min() < MIN_TURN_DEG else int(np.argmax(u.max(axis=0)))
    row = int(np.argmax(u[:, column]))
    term_name = f"scale_factor of {AXES[row]}" if row == column else f"misalignment_{AXES[column]} of {AXES[row]}"
    reason = (
        f"in all moves together the unit turned about {AXES[column]} by only {angle_deg[column]:.0f} deg"
        if angle_deg[column] < MIN_TURN_DEG
        else f"gravity changed too little in the turns about {AXES[column]}"
    )
    raise NotEnoughData(
        f"{serial}: the recording does not determine {term_name} (u = {u[row, column]:.2g}, limit {LARGEST_U:g}), "
        f"because {reason}; turn about the {AXES[column]} axis too, by 90 deg or more with {AXES[column]} level "
        "(a turn about the vertical does not change gravity and gives no information)"
    )


def turned_deg(moves: Moves) -> Array:
    """Return the turns about each axis, without sign and added over all moves, (3,) deg."""
    rest_rate_dps = np.median(moves.rate_dps[:, 0], axis=0)  # a move begins at rest
    mean = (moves.rate_dps[:, :-1] + moves.rate_dps[:, 1:]) / 2 - rest_rate_dps
    return np.asarray(np.abs(np.einsum("mki,mk->mi", mean, moves.step_s)).sum(axis=0))
