"""Recording a session on a bench in a wire log, whose header holds what a replay needs."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from importlib.metadata import version
from pathlib import Path

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.transport.wire_log.log_file import WireLogFile
from instruments.transport.wire_log.recorder import WireRecorder
from labctl.answers.wire_logs import RecordedSession, SessionResult
from labctl.errors import BadInput
from labctl.log import get_logger

log = get_logger()

#: Sections of a bench file that no instrument depends on and that name people or places.
LEFT_OUT = {"laboratory", "reported"}


class SessionLog:
    """The wire of a session, and its result once that is known."""

    def __init__(self, wire: WireRecorder) -> None:
        self.wire = wire
        self.result = SessionResult()  #: of the session, as a replay compares it


@contextmanager
def recording(
    path: Path | None, bench: BenchFile | None, clock: Clock, session: RecordedSession
) -> Iterator[SessionLog | None]:
    """Yield the wire log of a session; None without a path. `bench`: None where there is no bench file.

    `session` says what is done, as a replay does it again. The end of the session is written when the block is left,
    also by an error. Raises BadInput where the file cannot be written.
    """
    if path is None:
        yield None
        return
    try:
        file = WireLogFile(path, header_of(bench, clock, session))
    except OSError as error:
        raise BadInput(
            f"--wire-log {path}: the file cannot be written ({error.strerror}); name a file in a folder that exists"
        ) from error
    session_log = SessionLog(WireRecorder(file, clock))
    try:
        yield session_log
    except BaseException as error:
        session_log.result.ended_by = f"{type(error).__name__}: {error}"
        raise
    finally:
        file.close(clock.now_s(), session_log.result.model_dump(exclude_defaults=True))
        if file.failure or file.left_out:
            log.warning(
                "wire_log.incomplete", file=str(path), reason=file.failure or "the disk was too slow",
                left_out=file.left_out,
            )  # fmt: skip


def header_of(bench: BenchFile | None, clock: Clock, session: RecordedSession) -> dict[str, object]:
    """Return the header of a log that begins now."""
    now_s = clock.now_s()
    header: dict[str, object] = {
        "labctl": version("labctl"),
        "python": platform.python_version(),
        "system": platform.platform(),
        "clock_start": (clock.utc() - timedelta(seconds=now_s)).isoformat(),
        "now_s": now_s,
        "session": session.model_dump(exclude_defaults=True),
    }
    if bench is not None:
        header["bench"] = bench.model_dump(mode="json", exclude_none=True, exclude=LEFT_OUT)
    return header
