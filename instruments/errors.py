"""Errors of instruments. Every message names device, quantity, value, unit, limit and what to do.

InstrumentError
├── LinkError            the link is silent or broken
│   ├── NoReply          no reply within the time-out
│   └── MalformedReply   a reply that does not fit the protocol
├── RequestRejected      the instrument rejected the request
├── LimitError           the request lies outside a limit; nothing was sent
├── WrongInstrument      the instrument is not the one in the bench file
└── WrongSimulation      the simulation that the bench file asks for is not known
"""

from __future__ import annotations


def copy_of(kind: type[Exception], args: tuple[object, ...], attributes: dict[str, object]) -> Exception:
    """Return an error with this text and these attributes, whatever its constructor takes; for `__reduce__`."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(attributes)
    return error


def one_line(text: object) -> str:
    """Return a text of another library, or of a device, without line breaks and control characters."""
    return " ".join("".join(each if each.isprintable() else " " for each in str(text)).split())


class InstrumentError(Exception):
    """A failure of one device; `device` is its name in the bench file. The text is always one line."""

    def __init__(self, device: str, message: str) -> None:
        super().__init__(one_line(f"{device}: {message}"))
        self.device = device

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle it whole: a subclass may take other arguments than its text."""
        return copy_of, (type(self), self.args, self.__dict__)


class LinkError(InstrumentError):
    """The link is silent or broken."""


class NoReply(LinkError):
    """No reply arrived within the time-out."""


class MalformedReply(LinkError):
    """A reply arrived that does not fit the protocol or the request."""


class RequestRejected(InstrumentError):
    """The instrument rejected the request."""


class LimitError(InstrumentError):
    """The request lies outside a limit of the instrument; nothing was sent."""


class WrongInstrument(InstrumentError):
    """The instrument that replies is not the one in the bench file."""


class WrongSimulation(InstrumentError, ValueError):
    """The simulation of a bench file has an unknown profile, setting or hidden effect; nothing was opened."""
