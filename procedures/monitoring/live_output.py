"""The present output of each unit: the last readings are kept as they came and averaged only on request."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from instruments.interfaces.gyro import Channel, Gyro, Readings
from procedures.monitoring.campaign_time import CampaignTime


@dataclass(frozen=True)
class Output:
    """A moment of one channel of a unit, in the channel's unit."""

    gyro: str
    channel: str
    unit: str
    mean: float
    std: float  #: of single readings; 0 for a single one
    n: int
    t_s: float  #: campaign time of the last of them


class LiveOutput:
    """The last readings that each unit sent. One thread writes, any thread may read."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[tuple[Channel, ...], Readings, float]] = {}

    def heard(self, name: str, gyro: Gyro, readings: Readings, time: CampaignTime) -> None:
        """Keep the readings that a unit sent, whose times are the clock's."""
        if len(readings):
            self._last[name] = (tuple(gyro.channels), readings, time.of(float(readings.t_s[-1])))

    def forget(self, name: str | None = None) -> None:
        """Note that a unit, or every unit, sends nothing any more."""
        if name is None:
            self._last = {}
        else:
            self._last.pop(name, None)

    def outputs(self) -> tuple[Output, ...]:
        """Return the mean of what each unit sent last, channel by channel; readings it marked bad do not count."""
        found = []
        for name, (channels, readings, t_s) in list(self._last.items()):
            for channel in channels:
                if not channel.name.startswith("gyro_"):
                    continue
                values = channel.value(readings.raw[channel.name][readings.valid])
                if n := len(values):
                    spread = float(np.std(values, ddof=1)) if n > 1 else 0.0
                    found.append(Output(name, channel.name, channel.unit, float(np.mean(values)), spread, n, t_s))
        return tuple(found)
