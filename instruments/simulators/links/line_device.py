"""A simulated instrument that answers lines of text."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod

from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.simulators.links.faults import Faults

LONGEST_REQUEST_BYTES = 1024


class LineDevice(ABC):
    """Lines in, lines out. A request ends with a carriage return or a line feed."""

    reply_end = "\r\n"

    def __init__(self, syntax: LineSyntax, faults: Faults) -> None:
        self.faults = faults
        self._encoding = syntax.encoding
        self._pending = b""
        self._out = bytearray()

    @abstractmethod
    def answer(self, request: str, t_s: float) -> str | None:
        """Return the reply to a request; None for no reply."""

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes and answer every whole line in them."""
        *requests, self._pending = re.split(rb"[\r\n]+", self._pending[-LONGEST_REQUEST_BYTES:] + data)
        for request in filter(None, requests):
            if self.faults.trigger(["lost_reply", "silence"], t_s) is not None:
                self.answer(request.decode(self._encoding, errors="replace"), t_s)
                continue
            reply = self.answer(request.decode(self._encoding, errors="replace"), t_s)
            if reply is not None:
                self._out += (reply + self.reply_end).encode(self._encoding)

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
