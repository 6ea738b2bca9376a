"""How a device writes lines of text, as data."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LineSyntax:
    """A reply ends with a carriage return or a line feed, whichever comes first, or with a text of its own."""

    end: str = "\r\n"  #: of a request; may be empty
    reply_end: str = ""  #: a text that ends a reply; empty: a line end
    encoding: str = "ascii"
    #: A reply that refuses the request; its group `why` says why.
    refusal: str = ""
    #: Reason given by the device -> what it means.
    reasons: tuple[tuple[str, str], ...] = ()
    pause_s: float = 0.0  #: least time between two requests

    def reason(self, why: str) -> str:
        """Return what a reason that the device gave means, or the reason itself."""
        return dict(self.reasons).get(why, why)


@dataclass(frozen=True)
class Question:
    """A request, with the settings of the bench file in braces, and the pattern of a reply to it."""

    send: str
    reply: str
    what: str  #: what the request is for, in messages: "read ..."
