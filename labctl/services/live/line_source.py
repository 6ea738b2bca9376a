"""A stream of lines, such as a ROS topic: JSON or CSV."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from labctl.errors import BadInput
from labctl.fitting.live import PoseRequest
from labctl.recording import RecordingInfo
from labctl.recording.columns import ARRIVAL_S
from labctl.recording.line_stream import DecodedLines, LineDecoder
from labctl.services.live.line_feed import LineFeed
from labctl.services.live.source import Block, StreamEnded

#: Times further apart than this many of their usual spacings, which so many steps show, have a reading lost between.
GAP, MIN_STEPS = 1.5, 5
#: A stream without a reading for so long has ended, s; before the first it may take longer to begin.
SILENCE_S, FIRST_WITHIN_S = 10.0, 60.0


def info_of(serial: str, clock: Clock, latitude_deg: float | None, rate_hz: float | None = None) -> RecordingInfo:
    """Return what is known of a unit whose readings arrive as lines. Raises BadInput for a serial number."""
    return RecordingInfo(
        serial=serial, axes=("x", "y", "z"), kind="samples", motion="poses", started_at=clock.utc(),
        latitude_deg=latitude_deg, sample_rate_hz=rate_hz, notes="turned by hand, live",
    )  # fmt: skip


class LineSource:
    """Lines of a feed, decoded. `info` is what is known of the unit; its time of start is filled in."""

    is_simulated = False

    def __init__(self, feed: LineFeed, decoder: LineDecoder, info: RecordingInfo, clock: Clock) -> None:
        self._feed, self._decoder, self._info, self.clock = feed, decoder, info, clock
        self.name, self.serial = feed.name, info.serial
        self._last_s, self._begun = 0.0, False
        self._newest_s, self._spacing_s = np.empty(0), 0.0
        self._zero_s: float | None = None  #: clock time of the time 0 of the lines

    def start(self) -> RecordingInfo:
        """Open the feed; raises BadInput."""
        self._feed.open()
        self._last_s = self.clock.now_s()
        return self._info.model_copy(update={"started_at": self.clock.utc()})

    def read(self, duration_s: float) -> Block:
        """Return the readings of the lines that arrive in `duration_s`.

        Raises StreamEnded at the end, after SILENCE_S without a reading, and where the lines cannot be used any more;
        BadInput where the first cannot.
        """
        self.clock.sleep(duration_s)
        data = self._feed.take()
        if data is None:
            raise StreamEnded(f"{self.name} has ended")
        try:
            decoded = self._decoder.feed(data)
        except BadInput as error:
            if not self._begun:
                raise
            raise StreamEnded(str(error)) from error
        now_s = self.clock.now_s()
        if len(decoded):
            self._last_s, self._begun = now_s, True
        elif now_s - self._last_s > (SILENCE_S if self._begun else FIRST_WITHIN_S):
            raise StreamEnded(self._silence(now_s - self._last_s, decoded.example))
        columns = {**decoded.columns, ARRIVAL_S: self._arrivals(decoded, now_s)} if len(decoded) else {}
        return Block(columns, self._lost(columns), decoded.damaged, decoded.example)

    def _arrivals(self, decoded: DecodedLines, now_s: float) -> NDArray[np.float64]:
        """Return when the lines had arrived, (n,) s from the time 0 of the lines on: all when they were read.

        The first lines are taken to be as late as the newest of them: how long that was under way is not known.
        """
        if self._zero_s is None:
            self._zero_s = now_s - float(np.asarray(decoded.columns["t_s"], dtype=np.float64)[-1])
        return np.full(len(decoded), now_s - self._zero_s)

    def _lost(self, columns: Mapping[str, NDArray[np.generic]]) -> int:
        """Return how many readings of a feed that may lose some are missing, by the times that the lines carry."""
        if not self._feed.may_lose or "t_s" not in columns:
            return 0
        t_s = np.concatenate([self._newest_s, np.asarray(columns["t_s"], dtype=np.float64)])
        self._newest_s, steps = t_s[-1:], np.diff(t_s)
        self._spacing_s = self._spacing_s or (float(np.median(steps)) if len(steps) >= MIN_STEPS else 0.0)
        if self._spacing_s <= 0:
            return 0
        return int(np.sum(np.rint(steps[steps > GAP * self._spacing_s] / self._spacing_s) - 1))

    def _silence(self, silence_s: float, example: str) -> str:
        example_text = f"; what arrived is no reading: {example}" if example else ""
        return f"{self.name} gave no reading for {silence_s:.0f} s{example_text}; check the sender"

    def ask(self, request: PoseRequest | None) -> None:
        """Leave it to the person at the unit."""

    def stop(self) -> None:
        """Close the feed."""
        self._feed.close()
