"""The certification in a calibration file: whether it is in force, by whom, and until when it is valid.

It is part of the file's hash. The calibration itself is the same whether it is certified or not; its own hash is
`calibration_hash`.
"""

from __future__ import annotations

import hashlib
import json
import sys
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal, get_args

from labctl.canonical_json import canonical, with_own_hash

State = Literal["in-force", "superseded", "revoked"]
#: The member of a calibration file.
CERTIFICATION = "certification"
_DECODER = json.JSONDecoder()


class CalibrationWarning(UserWarning):
    """A calibration that is loaded is overdue, or was revoked."""


class LeftOutWarning(UserWarning):
    """A calibration is used without an input that part of its correction needs."""


@dataclass(frozen=True)
class Certification:
    """The newest act of certifying or revoking a version; `due` is aware UTC, None where no date was given."""

    state: State
    by: str
    reason: str
    at: datetime
    due: datetime | None
    calibration_hash: str
    #: What the verdict on the version does not show: of which parts of its model the cause is not known, in sentences.
    cause_not_known: tuple[str, ...] = ()

    def is_overdue(self, now: datetime) -> bool:
        """Whether the date until which it is valid has passed at an aware time."""
        return self.state != "revoked" and self.due is not None and now >= self.due

    def warning(self, what: str, now: datetime) -> str:
        """Return the warning for a user of calibration `what` at an aware time; empty where there is none."""
        if self.state == "revoked":
            return (
                f"calibration of {what} was revoked at {_said(self.at)} by {self.by} ({self.reason}); fetch the one in "
                "force"
            )
        if self.due is not None and now >= self.due:
            days = (now - self.due).total_seconds() / 86_400
            return (
                f"calibration of {what} was due on {_said(self.due)}, {days:.1f} days ago; calibrate the unit again, "
                "then fetch the new version"
            )
        return ""

    def to_json(self) -> dict[str, str | list[str] | None]:
        """Return it as the value of `certification` in a calibration file."""
        unknown = {"cause_not_known": list(self.cause_not_known)} if self.cause_not_known else {}
        return {
            "state": self.state, "by": self.by, "reason": self.reason, "at": self.at.isoformat(),
            "due": self.due.isoformat() if self.due else None, "calibration_hash": self.calibration_hash,
            **unknown,
        }  # fmt: skip


def read_certification(document: Mapping[str, object]) -> Certification:
    """Read the value of `certification`. Raises LookupError, TypeError or ValueError for one that is not whole."""
    states: tuple[State, ...] = get_args(State)
    stated, due = document["state"], document["due"]
    state: State | None = next((each for each in states if each == stated), None)
    if state is None:
        raise ValueError(f"the state is {str(stated)[:80]!r}, but must be one of {', '.join(states)}")
    unknown = document.get("cause_not_known", [])
    if not isinstance(unknown, list):
        raise TypeError(f"cause_not_known is {str(unknown)[:80]!r}, but must be a list of sentences")
    return Certification(
        state, str(document["by"]), str(document["reason"]), _instant(document["at"]),
        None if due is None else _instant(due), str(document["calibration_hash"]),
        tuple(map(str, unknown)),
    )  # fmt: skip


def warn(text: str, category: type[Warning] = CalibrationWarning) -> None:
    """Issue a warning at the line of the program that called labctl; nothing for an empty text."""
    if not text:
        return
    depth, frame = 1, sys._getframe(1)  # noqa: SLF001  Python 3.12 can skip a package's own frames
    while frame.f_back is not None and str(frame.f_globals.get("__name__", "")).partition(".")[0] == "labctl":
        depth, frame = depth + 1, frame.f_back
    warnings.warn(text, category, stacklevel=depth + 1)


def _instant(text: object) -> datetime:
    if not isinstance(text, str):
        raise TypeError(f"{text!r} is not a time; write it as 2027-03-01T08:00:00Z")
    instant = datetime.fromisoformat(text)
    if instant.tzinfo is None:
        raise ValueError(f"{text!r} has no time zone; end it with Z or an offset such as +01:00")
    return instant.astimezone(UTC)


def _said(at: datetime) -> str:
    return f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"


def with_certification(content: bytes, known: Certification) -> tuple[bytes, str]:
    """Return the bytes of a calibration file with its certification, and their hash, which covers it."""
    whole, digest = _inserted(content, known) or with_own_hash(
        {**json.loads(content), "certification": known.to_json()}
    )
    return whole + b"\n", digest


def _inserted(content: bytes, known: Certification) -> tuple[bytes, str] | None:
    """Return the same as writing the whole document anew, in a seventh of the time; None where that is not certain.

    A canonical document has its members in the order of their names, and its own hash in it just once.
    """
    text, hash_member = content.decode().strip(), f'"hash":"{known.calibration_hash}",'
    place = _place_of(CERTIFICATION, text)
    if place is None or text.count(hash_member) != 1:
        return None
    member = f"{canonical({CERTIFICATION: known.to_json()}).decode()[1:-1]},"
    before, after = f"{text[:place]}{member}{text[place:]}".split(hash_member)
    digest = hashlib.sha256(f"{before}{after}".encode()).hexdigest()
    return f'{before}"hash":"{digest}",{after}'.encode(), digest


def _place_of(name: str, text: str) -> int | None:
    """Return where a new member of a canonical JSON object begins; None where it is there, or would be the last."""
    place = 1
    try:
        while text[place] == '"':
            member, end = _DECODER.raw_decode(text, place)
            if member >= name:
                return None if member == name else place
            _, end = _DECODER.raw_decode(text, end + 1)
            place = end + 1
    except (ValueError, IndexError):
        pass
    return None
