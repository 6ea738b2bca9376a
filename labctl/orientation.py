"""Orientation by integrating one axis, with the offset renewed at standstill (Weiss, muRata Gyrostar report).

The report's program is a lesson in what goes wrong: an integer angle that overflows, a divider that truncates,
readings taken to be exactly periodic, an offset that goes on averaging while the vehicle turns, and an angle that
creeps while it stands. Here every reading carries its time, numbers are 64-bit, the offset is learned only from
stretches that were at rest from end to end, and the angle is held while they last.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput


@dataclass(frozen=True)
class StandstillRule:
    """When the vehicle counts as standing, and how its offset is learned then."""

    settle_s: float = 2.0  #: at rest this long before the angle is held and the offset learned
    near_dps: float = 2.0  #: a reading further than this from the offset in force is motion: some 5 times its noise
    quiet_dps: float = 0.5  #: readings that scatter by more over a stretch (standard deviation) are motion too
    learn_s: float = 20.0  #: an offset is the mean of at most this much of the newest rest
    max_gap_s: float = 1.0  #: a longer pause between readings is counted, and never bridged as rest


@dataclass(frozen=True)
class _Stretch:
    """A whole stretch of rest: `settle_s` long, no motion in it or right after it."""

    seconds: float
    mean_dps: float


class Orientation:
    """Follows the angle of one axis, positive counter-clockwise and never wrapped.

    `update` takes readings as they come, compensated or not. The angle is 64-bit and keeps whole turns. A slow, steady
    turn below `near_dps` cannot be distinguished from an offset by the gyro alone: tell `update` with
    `still=False` where the
    wheels know better.
    """

    def __init__(self, angle_deg: float = 0.0, offset_dps: float = 0.0, rule: StandstillRule | None = None) -> None:
        _refuse_no_number("angle", angle_deg)
        _refuse_no_number("offset", offset_dps)
        self._rule = rule or StandstillRule()
        self._angle_deg = float(angle_deg)
        self._offset_dps = float(offset_dps)
        self._last: tuple[float, float] | None = None
        self._stretch: list[tuple[float, float]] = []
        self._angle_at_stretch_deg = self._angle_deg
        self._waiting: _Stretch | None = None  #: whole, but the vehicle may have begun to move at its end
        self._rest: list[_Stretch] = []
        self._standing = False
        self.gap_s = 0.0  #: seconds without readings, bridged in a straight line

    @property
    def angle_deg(self) -> float:
        """The angle now, deg."""
        return self._angle_deg

    @property
    def offset_dps(self) -> float:
        """The offset that is taken off now, deg/s."""
        return self._offset_dps

    @property
    def standing(self) -> bool:
        """Whether the vehicle counts as standing; the angle is held meanwhile."""
        return self._standing

    def set_angle(self, angle_deg: float) -> None:
        """Set the angle from outside, deg. The offset stays. Raises BadInput when it is no number."""
        _refuse_no_number("angle", angle_deg)
        self._angle_deg = self._angle_at_stretch_deg = float(angle_deg)

    def set_offset(self, offset_dps: float) -> None:
        """Set the offset from outside, deg/s, such as a static bias; the angle stays. Raises BadInput for a NaN."""
        _refuse_no_number("offset", offset_dps)
        self._offset_dps = float(offset_dps)
        self._forget_rest()

    def update(self, t_s: float, rate_dps: float, *, still: bool | None = None) -> float:
        """Take one reading; returns the angle, deg.

        `still` is what others know: False means that the vehicle moves, True that it stands (the output need not be
        near the offset then), None lets the output tell. Raises BadInput when time does not go on, or for a reading
        that is no number.
        """
        self._refuse_bad(t_s, rate_dps)
        if self._last is not None and t_s - self._last[0] > self._rule.max_gap_s:
            self.gap_s += t_s - self._last[0]
            self._moving()
        stood = self._standing
        if not stood:
            self._integrate(t_s, rate_dps)
        self._judge(t_s, rate_dps, still)
        if stood and not self._standing:
            self._integrate(t_s, rate_dps)
        self._last = (t_s, rate_dps)
        return self._angle_deg

    def _integrate(self, t_s: float, rate_dps: float) -> None:
        if self._last is not None:
            before_s, before_dps = self._last
            self._angle_deg += (0.5 * (rate_dps + before_dps) - self._offset_dps) * (t_s - before_s)

    def follow(
        self, t_s: NDArray[np.float64], rate_dps: NDArray[np.float64], still: Iterable[bool] | None = None
    ) -> NDArray[np.float64]:
        """Take readings at times (n,) s of rates (n,) deg/s; returns the angle after each, (n,) deg."""
        known: Iterable[bool | None] = still if still is not None else [None] * len(t_s)
        rows = zip(t_s, rate_dps, known, strict=True)
        return np.array([self.update(float(t), float(rate), still=at_rest) for t, rate, at_rest in rows])

    def _refuse_bad(self, t_s: float, rate_dps: float) -> None:
        if not (np.isfinite(t_s) and np.isfinite(rate_dps)):
            raise BadInput(
                f"the reading at {t_s} s has the rate {rate_dps} deg/s, which is not a finite "
                "number; leave such readings out"
            )
        if self._last is not None and t_s <= self._last[0]:
            raise BadInput(
                f"the reading at {t_s:g} s was passed after the reading at {self._last[0]:g} s; pass the "
                "readings in order of time"
            )

    def _judge(self, t_s: float, rate_dps: float, still: bool | None) -> None:
        near = still or abs(rate_dps - self._offset_dps) <= self._rule.near_dps
        if still is False or not near:
            self._moving()
            return
        if not self._stretch:
            self._angle_at_stretch_deg = self._angle_deg
        self._stretch.append((t_s, rate_dps))
        if t_s - self._stretch[0][0] >= self._rule.settle_s:
            self._close_stretch(declared=bool(still))

    def _close_stretch(self, *, declared: bool) -> None:
        rates = np.array([rate for _, rate in self._stretch])
        mean = float(rates.mean())
        if not declared and float(rates.std(ddof=1)) > self._rule.quiet_dps:
            self._stretch.pop()
            self._moving()
            return
        if not self._standing:
            # What was integrated since the stretch began was offset and noise, not motion.
            self._angle_deg = self._angle_at_stretch_deg
            self._standing = True
        if self._waiting is not None:
            self._learn(self._waiting)
        self._waiting = _Stretch(self._stretch[-1][0] - self._stretch[0][0], mean)
        self._stretch = self._stretch[-1:]

    def _learn(self, stretch: _Stretch) -> None:
        self._rest.append(stretch)
        while sum(s.seconds for s in self._rest[1:]) >= self._rule.learn_s:
            del self._rest[0]
        weights = [s.seconds for s in self._rest]
        self._offset_dps = float(np.average([s.mean_dps for s in self._rest], weights=weights))

    def _moving(self) -> None:
        if self._standing:
            # The interrupted stretch may hold the beginning of the motion: its angle, which was withheld, is added.
            held = np.array(self._stretch)
            self._angle_deg += float(np.trapezoid(held[:, 1] - self._offset_dps, held[:, 0]))
        self._standing = False
        self._forget_rest()

    def _forget_rest(self) -> None:
        self._stretch = []
        self._waiting = None
        self._rest = []


def _refuse_no_number(quantity: str, value: float) -> None:
    if not np.isfinite(value):
        raise BadInput(f"{quantity} {value} is not a finite number; give a finite number")
