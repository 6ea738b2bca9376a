"""Columns of positions: which body axis points up in each row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from instruments.positions import AXES, EXPECTED, Position

__all__ = ["AXES", "EXPECTED", "Position", "axis_in", "comparable", "further", "lever_in", "radius_in", "up_in"]


def up_in(position: NDArray[np.generic], axis: str) -> NDArray[np.float64]:
    """Return how much of a body axis points up in each row, (n,): 1, -1 or 0, in a tilted mounting between them.

    Raises ValueError for a text that is no position.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    positions = [Position.of(text) for text in texts.tolist()]
    return np.array([each.up[AXES.index(axis)] for each in positions])[of]


def radius_in(position: NDArray[np.generic]) -> NDArray[np.float64]:
    """Return the distance of the unit from the table's axis in each row, (n,) m; NaN where it is not known.

    Raises ValueError like `up_in`.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    radii_m = [Position.of(text).radius_m for text in texts.tolist()]
    return np.array([np.nan if radius_m is None else radius_m for radius_m in radii_m])[of]


def lever_in(position: NDArray[np.generic], axis: str) -> NDArray[np.float64]:
    """Return the part along a body axis of the way from the table's axis to the unit in each row, (n,) m.

    NaN where distance or direction are not known. Raises ValueError like `up_in`.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    levers_m = [_lever_m(Position.of(text), AXES.index(axis)) for text in texts.tolist()]
    return np.array(levers_m)[of]


def _lever_m(position: Position, row: int) -> float:
    radius_m, outwards = position.radius_m, position.outwards
    return np.nan if radius_m is None or outwards is None else radius_m * outwards[row]


def further(position: NDArray[np.generic], by_mm: int) -> NDArray[np.str_]:
    """Return the positions (n,) of units that are further from the table's axis, where their distance is known."""
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    return np.array([str(_further(Position.of(text), by_mm)) for text in texts.tolist()], dtype=np.str_)[of]


def _further(position: Position, by_mm: int) -> Position:
    return position if position.radius_mm is None else replace(position, radius_mm=position.radius_mm + by_mm)


def comparable(position: NDArray[np.generic], turning: NDArray[np.bool_]) -> NDArray[np.str_]:
    """Return the positions (n,) of one fit, without the outward axes where some `turning` row (n,) has none.

    The centripetal part of the specific force is then not known in all rows, and must not count as 0 in those.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    levers_m = np.array([_lever_m(Position.of(text), 0) for text in texts.tolist()])[of]
    if not np.any(turning & np.isnan(levers_m)) or np.all(np.isnan(levers_m)):
        return position.astype(np.str_)
    return np.array([str(replace(Position.of(text), outward="")) for text in texts.tolist()], dtype=np.str_)[of]


def axis_in(position: NDArray[np.generic]) -> NDArray[np.str_]:
    """Return the body axis along the table axis in each row, (n,); empty in a tilted mounting.

    Raises ValueError like `up_in`.
    """
    texts, of = np.unique(position.astype(np.str_), return_inverse=True)
    return np.array([Position.of(text).axis for text in texts.tolist()], dtype=np.str_)[of]
