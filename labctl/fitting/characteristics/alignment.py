"""Misalignment and orthogonality, apart: polar decomposition of the matrix of scale factors and misalignments.

A matrix K, output over rate, is the product P R of a symmetric P and a rotation R (the left polar decomposition). R is
how the triad as a whole is turned in its case: misalignment, which a remounting can take away. P holds the scale
factors and by how much the sensing axes are off right angles to one another: orthogonality, which belongs to the unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.characteristics.estimate import Estimate

Matrix = NDArray[np.float64]
#: Pairs of sensing axes, as they are listed.
PAIRS = ((0, 1), (0, 2), (1, 2))
#: Relative step of the derivative by which uncertainties are carried on.
STEP = 1e-6


@dataclass(frozen=True)
class Alignment:
    """Rotation of the triad about the body axes x, y, z, and 90 deg minus the angle between each pair; all deg."""

    misalignment_deg: tuple[Estimate, Estimate, Estimate]
    orthogonality_deg: tuple[Estimate, Estimate, Estimate]  #: xy, xz, yz


def polar(k: Matrix) -> tuple[Matrix, Matrix]:
    """Return P, symmetric, and R, a rotation, (3, 3) each, with K = P R. Raises ValueError for a K that mirrors."""
    left, sizes, right = np.linalg.svd(k)
    rotation = left @ right
    if np.linalg.det(rotation) < 0:
        raise ValueError(
            "the matrix is a reflection, not a rotation: one axis, or all three, have the wrong "
            "sign; correct the sign of the output"
        )
    return left @ np.diag(sizes) @ left.T, rotation


def alignment_of(k: Matrix, u: Matrix | None) -> Alignment:
    """Return what a matrix, (3, 3) output over rate, says of the alignment; `u` are standard uncertainties of K.

    Raises ValueError for a K that mirrors.
    """
    values = _angles_deg(k)
    spread: list[float | None] = [None] * 6
    if u is not None:
        variance = np.zeros(6)
        for i in range(3):
            for j in range(3):
                moved = k.copy()
                moved[i, j] += STEP
                variance += ((_angles_deg(moved) - values) / STEP * u[i, j]) ** 2
        spread = np.sqrt(variance).tolist()
    estimates = [Estimate(float(value), each) for value, each in zip(values, spread, strict=True)]
    return Alignment((estimates[0], estimates[1], estimates[2]), (estimates[3], estimates[4], estimates[5]))


def _angles_deg(k: Matrix) -> NDArray[np.float64]:
    symmetric, rotation = polar(k)
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine = float(np.linalg.norm(skew)) / 2
    angle = float(np.arctan2(sine, (np.trace(rotation) - 1) / 2))
    rotation_rad = skew / 2 * (angle / sine if sine > 1e-15 else 1.0)
    # output = K rate: a triad turned by +a sees the rate turned by -a
    rows = symmetric / np.linalg.norm(symmetric, axis=1, keepdims=True)
    angle_errors_deg = [float(np.arcsin(np.clip(rows[i] @ rows[j], -1.0, 1.0))) for i, j in PAIRS]
    return np.rad2deg(np.array([*(-rotation_rad), *angle_errors_deg]))
