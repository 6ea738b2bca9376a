"""The wire log as a document: JSON Lines, compressed by gzip. The first line is the header, the last one the end.

Each line between is one event of one port: when it was opened or closed, what was sent, what was received. Bytes that
are all printable ASCII, tabs or line ends stand as `text`, others as `hex`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, cast

FORMAT = "labctl-wire-log/1"

#: opened, closed: the port. sent: to the instrument. received: by a request for bytes. arrived: by a reader that
#: empties the port all the time. failed: the operation raised the error `text`.
Kind = Literal["opened", "closed", "sent", "received", "arrived", "failed"]
KINDS: frozenset[str] = frozenset(Kind.__args__)  # type: ignore[attr-defined]

PRINTABLE = re.compile(rb"[\x20-\x7e\r\n\t]*")
#: Names of settings whose values no log shows.
SECRET = re.compile(r"password|passwd|passphrase|secret|token|credential|private|api_?key", re.IGNORECASE)
#: User and password in an address.
CREDENTIALS = re.compile(r"(?<=://)[^/@\s]+@")
REMOVED = "removed"


class WireLogError(ValueError):
    """A file is no wire log, or its header is not one that this release reads."""


@dataclass(frozen=True)
class Event:
    """One line of a wire log. `more` holds what only some events have, by its key in the file.

    `timed_out`: fewer bytes arrived than were asked for. `newest_s`, `width_s`: when the newest byte came, as the
    reader knows it. `method`, `status`, `metadata`: of a call. `at`: the operation that failed.
    """

    t_s: float  #: of the bench clock, at the end of the operation
    port: str  #: address in the bench file
    kind: Kind
    data: bytes = b""
    more: Mapping[str, object] = field(default_factory=dict)

    def number(self, key: str) -> float | None:
        """Return a number of `more`, such as a time in s; None where the event has none."""
        value = self.more.get(key)
        return float(value) if isinstance(value, int | float) else None


def line_of(event: Event) -> bytes:
    """Return an event as a line of the file."""
    record: dict[str, object] = {"t_s": event.t_s, "port": event.port, "did": event.kind}
    if event.data:
        text = PRINTABLE.fullmatch(event.data) is not None
        record["text" if text else "hex"] = event.data.decode("ascii") if text else event.data.hex()
    return _line(record | dict(event.more))


def event_of(record: Mapping[str, object]) -> Event:
    """Return the event of a line; raises WireLogError for a line that is none."""
    try:
        t_s, port, kind = float(cast(float, record["t_s"])), str(record["port"]), str(record["did"])
        data = bytes.fromhex(str(record["hex"])) if "hex" in record else str(record.get("text", "")).encode("ascii")
    except (KeyError, TypeError, ValueError) as error:
        raise WireLogError(f"a line is no event of a wire log ({error!r})") from error
    if kind not in KINDS:
        raise WireLogError(f"a line has did = {kind!r}; it must be one of {', '.join(sorted(KINDS))}")
    more = {key: value for key, value in record.items() if key not in {"t_s", "port", "did", "text", "hex"}}
    return Event(t_s, port, cast(Kind, kind), data, more)


def header_line(header: Mapping[str, object]) -> bytes:
    """Return the first line of the file; what its keys name as a secret is left out."""
    return _line({"format": FORMAT, **cast(dict[str, object], without_secrets(header))})


def end_line(t_s: float, result: Mapping[str, object]) -> bytes:
    """Return the last line of a session that came to its end."""
    return _line({"t_s": t_s, "did": "ended", "result": dict(result)})


def without_secrets(value: object) -> object:
    """Return a JSON value without what is secret by its key, and without user names in addresses."""
    if isinstance(value, Mapping):
        return {
            key: REMOVED if SECRET.search(str(key)) and each is not None else without_secrets(each)
            for key, each in value.items()
        }
    if isinstance(value, list | tuple):
        return [without_secrets(each) for each in value]
    return CREDENTIALS.sub("", value) if isinstance(value, str) else value


def _line(record: Mapping[str, object]) -> bytes:
    return json.dumps(record, ensure_ascii=True, separators=(",", ":")).encode("ascii") + b"\n"
