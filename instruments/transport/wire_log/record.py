"""Reading a wire log, whole or truncated: its header, its events port by port, its end."""

from __future__ import annotations

import json
import zlib
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import cast

from instruments.transport.wire_log.document import FORMAT, Event, Kind, WireLogError, event_of
from instruments.transport.wire_log.log_file import GZIP

READ_BYTES = 1 << 16
#: A longer line is no line of a wire log.
LONGEST_LINE_BYTES = 1 << 26


def lines_of(path: Path) -> Iterator[bytes]:
    """Yield the whole lines of a file, as far as it goes: what a killed process left half written is dropped.

    Raises WireLogError for a file that is not compressed by gzip, or damaged; OSError.
    """
    unpacker, rest = zlib.decompressobj(wbits=GZIP), b""
    with path.open("rb") as file:
        while block := file.read(READ_BYTES):
            while block:
                try:
                    rest += unpacker.decompress(block, LONGEST_LINE_BYTES)
                except zlib.error as error:
                    raise WireLogError(f"it cannot be decompressed ({error})") from error
                *whole, rest = rest.split(b"\n")
                yield from whole
                if len(rest) > LONGEST_LINE_BYTES:
                    raise WireLogError(f"a line is longer than {LONGEST_LINE_BYTES} bytes")
                block = unpacker.unconsumed_tail


class WireRecord:
    """The events of a wire log in their order, port by port; read as they are asked for.

    Events that another port has yet to ask for are kept in memory. Raises WireLogError naming the file, OSError.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.result: dict[str, object] | None = None  #: of the session; None: the end is not read, or not there
        self.last_s = 0.0  #: clock time of the last event that was read
        self._documents = self._read()
        self.header = self._first()
        self._waiting: dict[str, deque[Event]] = {}
        self._is_over = False

    def next(self, port: str) -> Event | None:
        """Return the next event of a port without taking it; None: there is none any more."""
        waiting = self._waiting.setdefault(port, deque())
        while not waiting and not self._is_over:
            self._read_on()
        return waiting[0] if waiting else None

    def take(self, port: str) -> Event:
        """Take the next event of a port; raises IndexError where there is none."""
        return self._waiting[port].popleft()

    def put_back(self, event: Event) -> None:
        """Make an event the next one of its port."""
        self._waiting[event.port].appendleft(event)

    def read_to_end(self) -> None:
        """Read what is left of the file; the end of the session is known then."""
        while not self._is_over:
            self._read_on()

    def left(self, kind: Kind) -> dict[str, int]:
        """Return the number of events of a kind that were not taken, by port; for a log that was read to its end."""
        counts = {port: sum(event.kind == kind for event in waiting) for port, waiting in self._waiting.items()}
        return {port: count for port, count in counts.items() if count}

    def _read_on(self) -> None:
        for record in self._documents:
            if record.get("did") == "ended":
                self.result = dict(cast(dict[str, object], record.get("result") or {}))
                self.last_s = float(cast(float, record.get("t_s", self.last_s)))
                continue
            event = self._event(record)
            self.last_s = event.t_s
            self._waiting.setdefault(event.port, deque()).append(event)
            return
        self._is_over = True

    def _event(self, record: dict[str, object]) -> Event:
        try:
            return event_of(record)
        except WireLogError as error:
            raise self._error(str(error)) from error

    def _first(self) -> dict[str, object]:
        header = next(self._documents, {})
        if (named_format := header.get("format")) != FORMAT:
            raise self._error(f"its format is {named_format!r}; this release reads {FORMAT!r}")
        return header

    def _read(self) -> Iterator[dict[str, object]]:
        try:
            for number, line in enumerate(lines_of(self.path), start=1):
                document = json.loads(line)
                if not isinstance(document, dict):
                    raise WireLogError(f"line {number} is no JSON object")
                yield document
        except (UnicodeDecodeError, json.JSONDecodeError) as error:
            raise self._error(f"line {number + 1 if 'number' in locals() else 1} is no JSON ({error})") from error
        except WireLogError as error:
            raise self._error(str(error)) from error

    def _error(self, reason: str) -> WireLogError:
        return WireLogError(f"{self.path} is no wire log of labctl: {reason}; give a file that --wire-log wrote")
