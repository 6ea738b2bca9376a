"""Replies of a simulated instrument that sends only when it was asked."""

from __future__ import annotations


class Replies:
    """The sending side of such an instrument: `_out` is sent the next time the link is read."""

    def __init__(self) -> None:
        self._out = bytearray()

    def transmit(self, t_s: float) -> bytes:  # noqa: ARG002  a reply goes out at once
        """Return the replies."""
        sent, self._out = bytes(self._out), bytearray()
        return sent

    def skip(self, t_s: float) -> None:
        """Lose the replies."""
        self.transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002
        """Return None: the instrument sends only replies."""
        return None
