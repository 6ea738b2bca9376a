"""The latch of a bench: a file outside process and database that remembers every stop until it was carried out.

A stop is *open* until a process has carried it out: the bench in its safe state, the campaign ended in the database.
Whatever drives the bench next carries out what is open before anything moves. A stop that *holds* keeps the bench from
moving by itself until a named person takes it back.

The file only grows, one JSON document per line, so that two processes can write at the same time and nothing that was
asked for is lost. Its first byte is a mark of its own, for a disk on which no line fits any more. A stop that only the
mark remembers gets an id by how many of those were carried out before, so that the next one is another stop.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from uuid import uuid4
from zlib import crc32

from instruments.clock import WallClock

NAME = "stops.jsonl"
#: Why a campaign ends with its service, whichever process ends it.
SERVICE_STOPS = "the service stops"
FILE, FOLDER = 0o600, 0o700
#: The first line while the mark is not set, and the byte that sets it.
UNMARKED, MARK = b" \n", b"!"
#: How the ids of stops begin that only the mark remembers.
MARK_ID = "mark"


@dataclass(frozen=True)
class StopRequest:
    """A stop that was asked for."""

    id: str
    at: str  #: ISO 8601, UTC
    by: str
    via: str  #: "command line", "key", "loopback", "signal"
    reason: str  #: and person, as they are recorded with the campaign
    campaign: int | None = None  #: the campaign that is to end; None: whatever runs
    holds: bool = True  #: whether nothing may move by itself until a named person takes the stop back

    @classmethod
    def new(
        cls, by: str, via: str, reason: str, campaign: int | None = None, *, holds: bool = True, stop_id: str = ""
    ) -> StopRequest:
        """Return a request of this moment."""
        at = WallClock().utc().isoformat(timespec="milliseconds")
        return cls(stop_id or uuid4().hex[:16], at, _plain(by[:200]), via, _plain(reason[:500]), campaign, holds)

    @classmethod
    def of_service_end(cls, by: str) -> StopRequest:
        """Return the stop of whatever runs on the bench of a service that was asked to end; holds nothing."""
        return cls.new(by, "signal", SERVICE_STOPS, holds=False)


@dataclass(frozen=True)
class LatchState:
    """What a latch says now."""

    open: tuple[StopRequest, ...] = ()  #: not carried out yet
    held: tuple[StopRequest, ...] = ()  #: not taken back yet; those that are open among them
    known: frozenset[str] = frozenset()  #: every stop that was ever asked for
    at_rest: frozenset[str] = frozenset()  #: those after which the table was confirmed to stand

    @property
    def unconfirmed(self) -> tuple[StopRequest, ...]:
        """The open stops after which it is not confirmed yet that the table stands."""
        return tuple(stop for stop in self.open if stop.id not in self.at_rest)


class StopLatch:
    """The latch of one bench. Any process, and any thread, may use it at any time."""

    def __init__(self, folder: Path) -> None:
        """Use the latch in a bench's folder; nothing is read or made before it is needed."""
        self._folder, self._path = folder, folder / NAME

    @property
    def stamp(self) -> tuple[int, int]:
        """What changes when a line is added: size and time of the file; zeros while there is none."""
        try:
            status = self._path.stat()
        except OSError:
            return 0, 0
        return status.st_size, status.st_mtime_ns

    def prepare(self) -> None:
        """Make the folder and the file, so that a full disk later leaves room for the mark. Raises OSError."""
        if self._path.exists():
            return
        self._folder.mkdir(parents=True, exist_ok=True, mode=FOLDER)
        new_folder = self._folder / f".{NAME}-{uuid4().hex}"
        handle = os.open(new_folder, os.O_WRONLY | os.O_CREAT | os.O_EXCL, FILE)
        try:
            os.write(handle, UNMARKED)
            os.fsync(handle)
            with contextlib.suppress(FileExistsError):  # another process was quicker: its file stays
                self._path.hardlink_to(new_folder)  # it appears whole, so that no line comes before its first
        finally:
            os.close(handle)
            new_folder.unlink()

    def request(self, stop: StopRequest) -> None:
        """Remember a stop; one that is known already stays as it is. Raises OSError where nothing could be written."""
        if stop.id in self.state().known:
            return
        try:
            self._append({"stop": asdict(stop)})
        except OSError:
            self._mark(MARK)

    def carried_out(self, ids: Iterable[str], text: str) -> None:
        """Note that stops were carried out, and how the bench was left. Raises OSError."""
        noted = list(ids)
        self._append({"carried_out": noted, "at": _now(), "text": text})
        if any(each.startswith(MARK_ID) for each in noted):  # only now, so that it stays where no line fits yet
            self._mark(UNMARKED[:1])

    def at_rest(self, ids: Iterable[str], text: str) -> None:
        """Note that the table was confirmed to stand; the stops stay open. Raises OSError."""
        self._append({"at_rest": list(ids), "at": _now(), "text": text})

    def take_back(self, ids: Iterable[str], by: str) -> None:
        """Note that a person lets the bench move again. Raises OSError."""
        self._append({"taken_back": list(ids), "at": _now(), "by": by})

    def state(self) -> LatchState:
        """Return what the latch says. A line that cannot be read counts as a stop: it may have been one."""
        try:
            lines = self._path.read_bytes().split(b"\n")
        except FileNotFoundError:
            return LatchState()
        except OSError as error:
            return _unreadable(f"the latch {self._path} cannot be read: {error.strerror}")
        requests: dict[str, StopRequest] = {}
        done: set[str] = set()
        back: set[str] = set()
        stands: set[str] = set()
        for line in lines[1:]:
            if not line.strip():
                continue
            try:
                entry = json.loads(line)
                if "stop" in entry:
                    stop = StopRequest(**entry["stop"])
                    requests[stop.id] = stop
                done.update(entry.get("carried_out", ()))
                back.update(entry.get("taken_back", ()))
                stands.update(entry.get("at_rest", ()))
            except (ValueError, TypeError, AttributeError):
                torn = f"torn-{crc32(line):08x}"
                requests[torn] = _unnamed(torn, "a line of the latch cannot be read; it may have been a stop")
        for marked in _marked(done, is_set=bool(lines[0].strip())):
            requests[marked] = _unnamed(marked, "asked for while the disk was full")
        still = tuple(stop for stop in requests.values() if stop.id not in done)
        held = tuple(stop for stop in requests.values() if stop.id not in back and (stop.holds or stop.id not in done))
        return LatchState(still, held, frozenset(requests), frozenset(stands))

    def _append(self, entry: dict[str, object]) -> None:
        """Add a line, on the disk when this returns."""
        self.prepare()
        line = json.dumps(entry, ensure_ascii=True).encode() + b"\n"
        handle = os.open(self._path, os.O_RDWR | os.O_APPEND)
        try:
            if os.fstat(handle).st_size and os.pread(handle, 1, os.fstat(handle).st_size - 1) != b"\n":
                line = b"\n" + line  # what another process could not finish stays a line of its own
            if os.write(handle, line) != len(line):
                raise OSError(28, "the line does not fit on the disk", str(self._path))
            os.fsync(handle)
        finally:
            os.close(handle)

    def _mark(self, byte: bytes) -> None:
        """Write the mark over the first byte, for which the disk has room."""
        handle = os.open(self._path, os.O_WRONLY)
        try:
            os.pwrite(handle, byte, 0)
            os.fsync(handle)
        finally:
            os.close(handle)


def _marked(done: set[str], *, is_set: bool) -> list[str]:
    """Return the ids of the stops that the mark remembered, and of the one that it remembers while it is set."""
    before = sorted(each for each in done if each.startswith(MARK_ID))
    return [*before, f"{MARK_ID}-{len(before)}"] if is_set else before


def _now() -> str:
    return WallClock().utc().isoformat(timespec="milliseconds")


def _plain(text: str) -> str:
    """Return a text with a space in place of each control character: no stop is refused for its words."""
    return "".join(each if each.isprintable() else " " for each in text)


def _unnamed(stop_id: str, reason: str) -> StopRequest:
    return StopRequest(stop_id, "", "", "", reason)


def _unreadable(reason: str) -> LatchState:
    stop = _unnamed("unreadable", reason)
    return LatchState((stop,), (stop,), frozenset({stop.id}))
