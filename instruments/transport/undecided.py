"""Readings of a stream that is late: they are passed on once it is decided whether readings before them are lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from instruments.interfaces.gyro import Readings
from instruments.transport.device_time import DeviceClock
from instruments.transport.sample_timing import StreamTime

Ticks = NDArray[np.int64]


class Undecided:
    """Keeps the readings of one stream while it is late: a loss among them would make their times wrong."""

    def __init__(self) -> None:
        self._kept: list[tuple[Readings, Ticks | None]] = []

    def drop(self) -> None:
        """Drop what is kept."""
        self._kept.clear()

    def take(self, device_time: DeviceClock | None = None) -> Readings | None:
        """Return what is kept, n >= 1, at the times that hold if none is lost, and forget it; None where nothing is."""
        joined: Readings | None = None
        parts: list[Ticks] = []
        for readings, ticks in self._kept:
            joined = readings if joined is None else readings.after(joined)
            parts += [] if ticks is None else [ticks]
        self._kept.clear()
        if joined is None or device_time is None or not parts:
            return joined
        return replace(joined, device_s=device_time.of(np.concatenate(parts), joined.t_s))

    def pass_on(
        self, readings: Readings, time: StreamTime, device_time: DeviceClock | None = None, ticks: Ticks | None = None
    ) -> Readings:
        """Return the readings whose times are decided: none, or `readings` after those that were kept.

        `time` has just given the times of `readings`, n >= 1. `ticks` (n,) or (n, 2) are their numbers by the device's
        own clock, of which `device_time` makes times: a number that begins again needs the time that has passed.
        """
        if time.is_late:
            self._kept.append((replace(readings, damaged=0), ticks))
            none = np.zeros(0) if device_time is not None else None
            return replace(readings.only(slice(0, 0)), lost=0, device_s=none)
        for before, before_ticks in reversed(self._kept):
            readings = readings.after(before)
            if ticks is not None and before_ticks is not None:
                ticks = np.concatenate([before_ticks, ticks])
        if self._kept:
            held = time.held_times
            readings = replace(readings, t_s=np.concatenate([held, readings.t_s[len(held) :]]))
            self._kept.clear()
        if device_time is None or ticks is None:
            return readings
        return replace(readings, device_s=device_time.of(ticks, readings.t_s))
