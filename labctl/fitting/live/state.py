"""What a live calibration knows at one moment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from labctl.fitting.estimation.result import FitResult
from labctl.fitting.live.directions import Direction, turn_between
from labctl.fitting.live.target import Target
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.readings import AXES
from labctl.fitting.uncertainty.largest_error import NORMAL_K

#: The coefficients that a target limits, and the limit of which it is.
_LIMITED = ("scale_factor", "misalignment")


@dataclass(frozen=True)
class PoseRequest:
    """What the person at the unit is asked for."""

    pose: Direction
    rest_s: float

    @property
    def text(self) -> str:
        """The request in words."""
        return f"turn the unit until it lies with {self.pose.text}, and leave it at rest for {self.rest_s:g} s"


@dataclass(frozen=True)
class LiveCoefficient:
    """One coefficient as it is known now."""

    axis: str
    name: str
    value: float
    expanded: float  #: U, k = 2
    unit: str
    limit: float | None  #: of U; None: the target states none

    @property
    def is_met(self) -> bool:
        """Whether U is within its limit."""
        return self.limit is None or self.expanded <= self.limit


@dataclass(frozen=True)
class LiveState:
    """What is known, what is missing, and what is asked for."""

    t_s: float  #: of the last reading
    readings: int
    lost: int  #: readings that are missing by the instrument's counter or by the clock
    damaged: int  #: lines or frames that could not be read
    still_s: float  #: how long the unit has been at rest now; 0 while it is turned
    rests: int
    covered: tuple[str, ...]  #: names of the asked poses that rests cover
    wanted: int  #: asked poses in all
    coefficients: tuple[LiveCoefficient, ...]  #: by the last fit; empty before the readings allow one
    missing: tuple[str, ...]  #: what is missing, in words; empty when the calibration is complete
    request: PoseRequest | None  #: None when the calibration is complete
    turns_left: int | None  #: turns until every U is within its limit, if it goes on falling with their number
    left_out: tuple[str, ...]  #: turns that the last fit could not use, and why, in order of time
    fit: FitResult | None
    up: tuple[float, float, float] | None  #: direction of the newest specific force in the body; it points up at rest

    @property
    def done(self) -> bool:
        """Whether the target is reached."""
        return not self.missing

    @property
    def off_deg(self) -> float | None:
        """Angle between the present pose and the one that is asked for, deg; None without either."""
        if self.up is None or self.request is None:
            return None
        return turn_between(np.array(self.up), np.array(self.request.pose.up))[1]

    @property
    def worst(self) -> LiveCoefficient | None:
        """The limited coefficient whose U is largest beside its limit; None before the first fit."""
        limited = [coefficient for coefficient in self.coefficients if coefficient.limit is not None]
        return max(limited, key=lambda each: each.expanded / (each.limit or 1.0), default=None)


def coefficients_of(result: FitResult, target: Target) -> Iterator[LiveCoefficient]:
    """Yield the coefficients of a fit in poses, axis by axis, with U and its limit."""
    for axis in AXES:
        axis_fit = result.fitted.axes[axis]
        for name, value, u, unit_symbol in zip(
            axis_fit.names, axis_fit.values[:, 0], axis_fit.u[:, 0], axis_fit.units, strict=True
        ):
            limit = target.u if name.startswith(_LIMITED) else target.bias_dps if name == "bias" else None
            yield LiveCoefficient(axis, name, float(value), NORMAL_K * float(u), unit_symbol, limit)


def left_out_of(result: FitResult) -> tuple[str, ...]:
    """Return the turns that a fit in poses could not use, and why, in words."""
    moves = () if result.poses is None else result.poses["moves"]["left_out"]
    return tuple(
        f"the turn from {move['from_s']:.0f} s to {move['until_s']:.0f} s is not used: {move['why']}" for move in moves
    )


def needs_of_fit(coefficients: tuple[LiveCoefficient, ...]) -> Array:
    """Return how much a turn about each axis would add, (3,): by the least certain coefficient that it tells."""
    missing = np.zeros(3)
    for coefficient in coefficients:
        if coefficient.name == "scale_factor" or coefficient.name.startswith("misalignment"):
            column = (
                AXES.index(coefficient.axis)
                if coefficient.name == "scale_factor"
                else "xyz".index(coefficient.name[-1])
            )
            missing[column] = max(missing[column], coefficient.expanded / (coefficient.limit or 1.0))
    return missing


def turns_left(coefficients: tuple[LiveCoefficient, ...], turns: int) -> int | None:
    """Return how many turns are still needed if U falls with the square root of their number; None before a fit."""
    ratios = [coefficient.expanded / coefficient.limit for coefficient in coefficients if coefficient.limit is not None]
    if not ratios:
        return None
    return max(int(np.ceil(turns * (max(ratios) ** 2 - 1.0))), 0)
