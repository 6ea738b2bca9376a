"""The notice that a calibration, or the certificate of one, was withdrawn: as data, and as a field of HTTP."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime

#: Field of HTTP that a service sends with a calibration or a certificate that was withdrawn.
HEADER = "X-Labctl-Withdrawn"
_MEMBER = re.compile(r'(\w+)="((?:[^"\\]|\\.)*)"')


@dataclass(frozen=True)
class Withdrawn:
    """Who withdrew it, when (aware UTC) and why; `certificate` is its number where a certificate was withdrawn."""

    at: datetime
    by: str
    reason: str
    certificate: str = ""

    @property
    def text(self) -> str:
        """The notice in words."""
        subject = f"certificate {self.certificate} was withdrawn" if self.certificate else "the version was revoked"
        return f"{subject} at {self.at.astimezone(UTC):%Y-%m-%d %H:%M} UTC by {self.by} ({self.reason})"

    def header(self) -> str:
        """Return the value of `HEADER`: members with strings (RFC 8941, 3.2), in visible ASCII."""
        at = f"{self.at.astimezone(UTC):%Y-%m-%dT%H:%M:%SZ}"
        members = {"at": at, "by": self.by, "reason": self.reason, "certificate": self.certificate}
        return ", ".join(f"{name}={quoted(value)}" for name, value in members.items() if value)


def read_withdrawn(field: str) -> Withdrawn:
    """Read the value of `HEADER`. Raises ValueError for one that names no date."""
    members = {name: re.sub(r"\\(.)", r"\1", value) for name, value in _MEMBER.findall(field)}
    if "at" not in members:
        raise ValueError(f"{HEADER}: {field[:200]!r} names no date `at`")
    return Withdrawn(
        datetime.fromisoformat(members["at"]),
        members.get("by", ""),
        members.get("reason", ""),
        members.get("certificate", ""),
    )


def quoted(text: str) -> str:
    """Return a quoted string of an HTTP field (RFC 9110, 5.6.4): visible ASCII, what else there is becomes `?`."""
    plain = "".join(char if " " <= char <= "~" else "?" for char in text)
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"') + '"'
