"""Errors of instruments. Every message names device, quantity, value, unit, limit and what to do.

InstrumentError
├── LinkError            the link is silent or broken
│   ├── NoReply          no reply within the time-out
│   └── MalformedReply   a reply that does not fit the protocol
├── RequestRejected      the instrument rejected the request
├── LimitError           the request lies outside a limit; nothing was sent
└── WrongInstrument      the instrument is not the one in the bench file
"""

from __future__ import annotations


class InstrumentError(Exception):
    """A failure of one device; `device` is its name in the bench file."""

    def __init__(self, device: str, message: str) -> None:
        super().__init__(f"{device}: {message}")
        self.device = device


class LinkError(InstrumentError):
    """The link is silent or broken."""


class NoReply(LinkError):
    """No reply came within the time-out."""


class MalformedReply(LinkError):
    """A reply came that does not fit the protocol or the request."""


class RequestRejected(InstrumentError):
    """The instrument rejected the request."""


class LimitError(InstrumentError):
    """The request lies outside a limit of the instrument; nothing was sent."""


class WrongInstrument(InstrumentError):
    """The instrument that replies is not the one in the bench file."""
