"""Where the readings of a live calibration come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from labctl.fitting.live import PoseRequest
from labctl.recording import RecordingInfo

#: Why a live calibration ended: its target was reached, the stream ended or failed, a person or the service ended it.
Reason = Literal["complete", "stream", "interrupted"]


class StreamEnded(Exception):
    """No further reading will come; the text says why."""

    def __init__(self, text: str, reason: Reason = "stream") -> None:
        super().__init__(text)
        self.reason: Reason = reason


@dataclass(frozen=True)
class Block:
    """n readings of a stream, and what was wrong in it."""

    columns: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)  #: of a recording, (n,) each
    lost: int = 0  #: readings that are missing by the instrument's counter or by the clock
    damaged: int = 0  #: lines or frames that are no reading
    example: str = ""  #: what is wrong with the first damaged one, where that is known

    def __len__(self) -> int:
        return len(self.columns.get("t_s", ()))


class LiveSource(Protocol):
    """A stream of readings. Time is s since the first."""

    name: str  #: the stream as a message names it
    serial: str  #: of the unit
    clock: Clock
    is_simulated: bool

    def start(self) -> RecordingInfo:
        """Open the stream; returns the head of its recording. Raises LabctlError, InstrumentError."""
        ...

    def read(self, duration_s: float) -> Block:
        """Return the readings of the next `duration_s` seconds; there may be none.

        Raises StreamEnded when the stream has ended or gives no reading any more, BadInput where its lines cannot be
        used, and InstrumentError.
        """
        ...

    def ask(self, request: PoseRequest | None) -> None:
        """Take what the person at the unit is asked for; only a simulated person reads it here."""
        ...

    def stop(self) -> None:
        """Close the stream; safe to call twice."""
        ...
