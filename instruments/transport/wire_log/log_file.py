"""Writing a wire log: events are queued by the threads that use ports, and written by a thread of its own.

A slow or full disk never delays an instrument for longer than `STALL_S` once: then events are left out, which the log
says. What was queued is in the file `FLUSH_S` of real time later; a killed process leaves a file that can be read up to
there.
"""

from __future__ import annotations

import os
import threading
import zlib
from collections import deque
from collections.abc import Mapping
from pathlib import Path

from instruments.logger import logger
from instruments.transport.wire_log.document import Event, end_line, header_line, line_of

log = logger(__name__)

#: From one write to the next, s of real time.
FLUSH_S = 0.25
#: Queued bytes from which the thread writes at once, and at which who adds an event waits.
WRITE_FROM_BYTES, MAX_QUEUED_BYTES = 1 << 20, 16 << 20
#: Memory of an event beside its bytes, about.
EVENT_BYTES = 300
#: Longest wait for the disk of who adds an event, and at the end of the session, s of real time.
STALL_S, END_S = 1.0, 5.0
#: zlib's number of a stream with the header of gzip.
GZIP = 31


class WireLogFile:
    """One wire log that is being written. `note` may be called by any thread. Raises OSError for the file."""

    def __init__(self, path: Path, header: Mapping[str, object]) -> None:
        """Create the file, readable by its owner alone, with its header; an older one is replaced."""
        self.path = path
        self.failure = ""  #: why nothing more is written; empty while everything is
        self.left_out = 0  #: events that are not in the file, as the disk was too slow or full
        self._file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb", buffering=0)
        self._packer = zlib.compressobj(wbits=GZIP)
        self._changed = threading.Condition()
        self._queue: deque[Event] = deque()
        self._queued_bytes = 0
        self._is_stalled = self._is_closing = False
        self._write(header_line(header))
        self._thread = threading.Thread(target=self._run, name="wire log", daemon=True)
        self._thread.start()

    def note(self, event: Event) -> None:
        """Queue an event; raises nothing."""
        with self._changed:
            if self._queued_bytes > MAX_QUEUED_BYTES and not self._is_stalled:
                self._changed.notify_all()
                self._is_stalled = not self._changed.wait_for(self._has_room, STALL_S)
            if self.failure or self._is_stalled or self._is_closing:
                self.left_out += 1
                return
            self._queue.append(event)
            self._queued_bytes += len(event.data) + EVENT_BYTES
            if self._queued_bytes >= WRITE_FROM_BYTES:
                self._changed.notify_all()

    def rename(self, path: Path) -> None:
        """Rename the file in the same file system; what is there is replaced. Raises OSError."""
        self.path = self.path.replace(path)

    def close(self, t_s: float, result: Mapping[str, object] | None = None) -> None:
        """Write what is queued, and the end of the session where it has a result; safe to call twice."""
        with self._changed:
            if self._is_closing:
                return
            self._is_closing = True
            self._changed.notify_all()
        self._thread.join(END_S)
        if self._thread.is_alive():
            self.failure = self.failure or f"the disk did not take the log within {END_S:g} s"
            return  # the thread has the file
        try:
            ended = {} if result is None else {"result": dict(result)}
            tail = b"" if result is None else end_line(t_s, ended["result"] | {"left_out": self.left_out})
            if not self.failure:
                self._file.write(self._packer.compress(tail) + self._packer.flush())
        except OSError as error:
            self._fail(error)
        finally:
            self._file.close()

    def _has_room(self) -> bool:
        return self._queued_bytes <= MAX_QUEUED_BYTES or bool(self.failure)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._is_closing or self._queued_bytes >= WRITE_FROM_BYTES, FLUSH_S)
                events, closing = list(self._queue), self._is_closing
                self._queue.clear()
                self._queued_bytes, self._is_stalled = 0, False
                self._changed.notify_all()
            if events and not self.failure:
                self._write(b"".join(map(line_of, events)))
            if closing:
                return

    def _write(self, lines: bytes) -> None:
        """Write lines so that they can be read whatever happens next."""
        try:
            self._file.write(self._packer.compress(lines) + self._packer.flush(zlib.Z_SYNC_FLUSH))
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        self.failure = f"{self.path} cannot be written ({error.strerror or error})"
        log.warning("wire_log.failed", extra={"reason": self.failure})
