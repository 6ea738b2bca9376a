"""The lock beside an SQLite file that makes one process its only writer, and the note that names that process."""

from __future__ import annotations

import fcntl
import json
import os
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from labctl.errors import Conflict
from labctl.store.connection.location import is_url
from labctl.store.connection.private_files import FILE, write_private


@dataclass(frozen=True)
class ServiceAddress:
    """Where a service that holds a database is reached."""

    url: str | None = None  #: its HTTP API
    calls: str | None = None  #: folder of the Unix sockets of its bench process


NO_SERVICE = ServiceAddress()


@dataclass(frozen=True)
class Holder:
    """Who writes to a database now."""

    pid: int
    url: str | None  #: of the service, where the holder is one
    campaign: int | None = None  #: that runs in the holder's terminal, where the holder is no service
    calls: str | None = None  #: folder of the Unix sockets of the service's bench process


def _describe(holder: Holder) -> str:
    if holder.campaign is not None:
        return (
            f"campaign {holder.campaign} runs in process {holder.pid}'s terminal: Ctrl-C there ends it safely. "
            "Wait for its end: only a campaign under `labctl serve` can be paused or aborted by another command"
        )
    who = f"the service at {holder.url}" if holder.url else f"process {holder.pid} of labctl"
    return f"{who} is writing to this database; wait until it ends, or send the request to that process"


def holder_of(location: str) -> Holder | None:
    """Return who holds a database file for writing; None when it is free."""
    if is_url(location):
        return None
    return _read_note(location) if _is_locked(location) else None


def _is_locked(location: str) -> bool:
    """Return whether a process has the lock; makes no file, so that a database that may only be read can be asked."""
    try:
        lock = os.open(_lock_path(location), os.O_RDONLY)
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)  # as FileLock takes it (flock(2))
    except BlockingIOError:
        return True
    finally:
        os.close(lock)
    return False


def _lock_path(location: str) -> str:
    return f"{location}.lock"


def _note_path(location: str) -> Path:
    return Path(f"{location}.holder")


def _read_note(location: str) -> Holder:
    try:
        note = json.loads(_note_path(location).read_text(encoding="utf-8"))
        return Holder(int(note["pid"]), note["url"], note.get("campaign"), note.get("calls"))
    except (OSError, ValueError, KeyError):
        return Holder(0, None)


def note_campaign(location: str, campaign: int) -> None:
    """Note beside a database that this process holds it for a campaign; other processes show it."""
    if is_url(location):
        return
    with suppress(OSError):  # a full disk: the note is only a hint
        note = {"pid": os.getpid(), "url": None, "campaign": campaign}
        write_private(_note_path(location), json.dumps(note))


class WriterLock:
    """The lock on one SQLite file, held from its making to `release`."""

    def __init__(self, location: str, address: ServiceAddress = NO_SERVICE) -> None:
        """Take the lock and note at which address this process can be asked to write.

        Raises Conflict naming the holder, and OSError, which names the file, when the note cannot be written.
        """
        self._location = location
        self._lock = FileLock(_lock_path(location), mode=FILE)
        try:
            self._lock.acquire(timeout=0)
        except Timeout:
            raise Conflict(f"{location}: {_describe(_read_note(location))}") from None
        try:
            self.note(address)
        except OSError:
            self.release()
            raise

    def note(self, address: ServiceAddress) -> None:
        """Write down at which address this process is reached. Raises OSError."""
        note = {"pid": os.getpid(), **asdict(address)}
        write_private(_note_path(self._location), json.dumps(note))

    def release(self) -> None:
        """Release the writer's lock. Safe to call twice."""
        if self._lock.is_locked:
            _note_path(self._location).unlink(missing_ok=True)
            self._lock.release()
