"""How long steps of earlier campaigns took on a bench: homing, mounting, and moves of its chamber.

A move by a way of w kelvin takes w / r + s: r is the rate of the ramp, s the time in which the air settles after it.
Both are by the medians of Theil and Sen, so that a few moves that a pause or a person made longer do not count.
Heating and cooling are apart. Source: P. K. Sen, Estimates of the regression coefficient based on Kendall's tau,
Journal of the American Statistical Association 63 (1968), 1379.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from statistics import median

from procedures.contracts.steps import CheckHome, Home, Mount, MoveChamber, Step

#: Ways that differ by less tell no ramp, K.
MIN_SPREAD_C = 5.0
#: A ramp that is further from the stated one than by this factor is none of this chamber.
MAX_FACTOR = 4.0


@dataclass(frozen=True)
class DoneStep:
    """A step of an earlier campaign that was done."""

    campaign: int
    step: Step
    took_s: float


@dataclass(frozen=True)
class ChamberMoves:
    """How the chamber moves in one direction."""

    ramp_c_per_min: float | None  #: None: the ways were too alike to tell, and the stated one holds
    settling_s: float  #: beyond the ramp
    moves: int

    def move_s(self, way_c: float, stated_c_per_min: float) -> float:
        """Return how long a move by `way_c` >= 0 K takes, s, where the bench states a ramp of `stated_c_per_min`."""
        return 60.0 * way_c / (self.ramp_c_per_min or stated_c_per_min) + self.settling_s


@dataclass(frozen=True)
class EarlierTimes:
    """What earlier campaigns of a bench tell of its times; None: nothing."""

    campaigns: int
    home_s: float | None = None
    check_home_s: float | None = None
    mount_s: float | None = None
    heating: ChamberMoves | None = None
    cooling: ChamberMoves | None = None

    def moves(self, way_c: float) -> ChamberMoves | None:
        """Return what is known of moves by `way_c` K, of the other direction where nothing is known of this one."""
        same, other = (self.heating, self.cooling) if way_c > 0 else (self.cooling, self.heating)
        return same or other


def earlier_times(done: Sequence[DoneStep], stated_c_per_min: float) -> EarlierTimes | None:
    """Return what steps tell, in the order in which they were done; None where they tell nothing.

    `stated_c_per_min` is the ramp of the chamber by its bench file.
    """
    ways = list(_ways(done))
    times = EarlierTimes(
        len({each.campaign for each in done}),
        _usual(done, Home),
        _usual(done, CheckHome),
        _usual(_with_table(done), Mount),
        _moves([(way_c, took_s) for way_c, took_s in ways if way_c > 0], stated_c_per_min),
        _moves([(-way_c, took_s) for way_c, took_s in ways if way_c < 0], stated_c_per_min),
    )
    known = (times.home_s, times.check_home_s, times.mount_s, times.heating, times.cooling)
    return times if any(each is not None for each in known) else None


def _usual(done: Sequence[DoneStep], kind: type[Home | CheckHome | Mount]) -> float | None:
    took_s = [each.took_s for each in done if isinstance(each.step, kind)]
    return median(took_s) if took_s else None


def _with_table(done: Sequence[DoneStep]) -> list[DoneStep]:
    """Return the steps of campaigns with a table: without one, units are placed by hand, which is another work."""
    homed = {each.campaign for each in done if isinstance(each.step, Home)}
    return [each for each in done if each.campaign in homed]


def _ways(done: Sequence[DoneStep]) -> Iterator[tuple[float, float]]:
    """Yield way, K, and time, s, of each move that began at the set point of the one before in its campaign."""
    moves = [(each, each.step) for each in done if isinstance(each.step, MoveChamber)]
    for (before, from_), (after, to) in pairwise(moves):
        way_c = to.temperature_c - from_.temperature_c
        if to.wait and before.campaign == after.campaign and abs(way_c) > to.band_c:
            yield way_c, after.took_s


def _moves(ways: Sequence[tuple[float, float]], stated_c_per_min: float) -> ChamberMoves | None:
    """Return what moves by ways > 0, K, tell; None for no move."""
    if not ways:
        return None
    slopes = [
        (took_s - other_s) / (way_c - other_c)
        for (way_c, took_s), (other_c, other_s) in combinations(ways, 2)
        if abs(way_c - other_c) >= MIN_SPREAD_C
    ]
    ramp = None
    if slopes and (slope := median(slopes)) > 0 and 1 / MAX_FACTOR < 60.0 / slope / stated_c_per_min < MAX_FACTOR:
        ramp = 60.0 / slope
    settling_s = median(took_s - 60.0 * way_c / (ramp or stated_c_per_min) for way_c, took_s in ways)
    return ChamberMoves(ramp, settling_s, len(ways))
