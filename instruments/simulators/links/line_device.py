"""A simulated instrument that answers lines of text."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod

from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.replies import Replies

LONGEST_REQUEST_BYTES = 1024


class LineDevice(Replies, ABC):
    """Lines in, lines out. A request ends with a carriage return or a line feed."""

    reply_end = "\r\n"

    def __init__(self, syntax: LineSyntax, faults: Faults) -> None:
        super().__init__()
        self.faults = faults
        self._encoding = syntax.encoding
        self._pending = b""

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
