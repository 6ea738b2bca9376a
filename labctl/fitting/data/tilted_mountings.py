"""Tilted mountings without the straight ones that would separate their angles: what these angles do to a matrix.

Mountings k with unit vectors d_k of the body along the table axis and shares w_k in what is known of slopes over the
rate give each row of the matrix K by least squares, K_i = M^-1 sum_k w_k d_k y_ik with M = sum_k w_k d_k d_k'. An axis
of rotation that leans by a_k, across d_k, adds a_k to the slopes of all outputs, and so sum_k a_k g_k' to the matrix,
with g_k = w_k M^-1 d_k. With one axis after the other along the table axis g_k is that axis, and a_k a misalignment.
With tilted ones it is a scale factor too, to first order: only the fixture states the direction of a tilted mounting.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.mounting_angles import tilted_beside
from labctl.fitting.numeric.arrays import Array
from labctl.recording.positions import Position

#: Share of the largest eigenvalue of M below which mountings do not determine a matrix; and that of unit vectors.
SINGULAR, DIRECTIONS_TOLERANCE = 1e-6, 1e-3
#: What the directions of tilted mountings are known by.
TILTED = "tilted_fixture_angle"


@dataclass(frozen=True)
class LeaningMounting:
    """What the two angles by which the axis of rotation of one mounting leans do to a matrix of nine elements."""

    is_tilted: bool
    across: Array  #: (2, 3): orthonormal directions towards which the axis of rotation leans
    gain: Array  #: (3,): g of the mounting

    @property
    def matrices(self) -> Array:
        """The change of the matrix [output, body axis] per radian of each angle, (2, 3, 3)."""
        return np.asarray(self.across[:, :, None] * self.gain[None, None, :])


def has_tilted(positions: Iterable[str]) -> bool:
    """Return whether the angles of some tilted mounting are not separated from the coefficients."""
    names = tuple(positions)
    return any(Position.of(name).is_tilted for name in names) and not tilted_beside(names)


def leaning_mountings(shares: Mapping[str, float]) -> list[LeaningMounting]:
    """Return what each mounting's angles do to the matrix, for position -> share in what is known of slopes.

    Of mountings that do not determine the matrix, the smallest change that explains what they show.
    """
    positions = [Position.of(name) for name in shares]
    up = np.array([position.up for position in positions])
    weights = np.array(list(shares.values()))
    information = (up * weights[:, None]).T @ up
    gains = weights[:, None] * (up @ np.linalg.pinv(information, rcond=SINGULAR, hermitian=True))
    leaning = []
    for position, direction, gain in zip(positions, up, gains, strict=True):
        across = np.linalg.svd(direction[None, :])[2][1:]
        leaning.append(LeaningMounting(position.is_tilted, across, gain))
    return leaning


def undetermined(positions: Iterable[str]) -> str:
    """Return which mountings, some of them tilted, do not determine the nine elements of a matrix; empty: they do."""
    every = [Position.of(name) for name in positions]
    if not any(position.is_tilted for position in every):
        return ""
    directions = np.array([position.up for position in every])
    if np.linalg.matrix_rank(directions, tol=DIRECTIONS_TOLERANCE) == len(BODY_AXES):
        return ""
    return ", ".join(dict.fromkeys(position.end for position in every))


def element_gain(shares: Mapping[str, float], output: str, about: str, *, tilted: bool | None = None) -> float:
    """Return the root sum square of what the angles of mountings do to one element of the matrix, per radian.

    `tilted` counts the tilted ones alone, or the others; None: all.
    """
    place = (BODY_AXES.index(output), BODY_AXES.index(about))
    parts = [
        float(change[place])
        for mounting in leaning_mountings(shares)
        if tilted is None or mounting.is_tilted == tilted
        for change in mounting.matrices
    ]
    return math.hypot(*parts)
