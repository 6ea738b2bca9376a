"""The instrument part of the error tree. Every message names device, quantity, value, unit, limit and what to do.

InstrumentError
├── LinkError            the wire is silent, broken or gone
│   ├── NoReply          nothing came back in time
│   └── Garbled          something came back that is not the protocol's
├── Refused              the instrument answered, and said no
├── LimitError           the request lies outside a limit; nothing was sent
└── WrongInstrument      what answers is not what the bench file says
"""

from __future__ import annotations


class InstrumentError(Exception):
    """A failure of one device. `device` is its name in the bench file; the text says what to do."""

    def __init__(self, device: str, message: str) -> None:
        super().__init__(f"{device}: {message}")
        self.device = device


class LinkError(InstrumentError):
    """The wire is silent, broken or gone."""


class NoReply(LinkError):
    """Nothing came back in time."""


class MalformedReply(LinkError):
    """Something came back that is not the protocol's."""


class RequestRejected(InstrumentError):
    """The instrument answered, and said no."""


class LimitError(InstrumentError):
    """The request lies outside a limit of the instrument; nothing was sent."""


class WrongInstrument(InstrumentError):
    """What answers is not what the bench file says."""
