"""Where each bench's latch lies, and the note that says which process drives the bench now.

The folder of a bench is beside the SQLite file; for a database on a server it is in the user's state folder. A pointer
in the state folder leads to the folder of every bench that this user has driven, so that a stop finds a bench without
knowing its database.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from labctl.stop.latch import FOLDER, StopLatch

TICKS_PER_S = os.sysconf("SC_CLK_TCK")
NOTE = "driver.json"
POINTERS = "benches"


@dataclass(frozen=True)
class ProcessId:
    """A process, named so that another one with the same number is not taken for it."""

    pid: int = 0
    started: int = 0  #: clock ticks after the start of the computer
    boot: str = ""

    @classmethod
    def of(cls, pid: int) -> ProcessId:
        """Return the name of a process; that of none where it has ended."""
        started = _started(pid)
        return cls() if started is None else cls(pid, started, _boot())

    @property
    def lives(self) -> bool:
        """Whether the process is there; one that has ended and was not waited for is not."""
        return self.boot == _boot() and _started(self.pid) == self.started

    @property
    def age_s(self) -> float:
        """How long ago the process was started, s; 0 where the system does not say."""
        with contextlib.suppress(OSError, ValueError, IndexError):
            return float(Path("/proc/uptime").read_text(encoding="ascii").split()[0]) - self.started / TICKS_PER_S
        return 0.0

    @property
    def stands_still(self) -> bool:
        """Whether the process was stopped, by a signal or a debugger: it answers nothing before it goes on."""
        fields = _fields(self.pid)
        return bool(fields) and fields[0] in {"T", "t"}


@dataclass(frozen=True)
class DriverNote:
    """Which process drives a bench, how it is reached, and what the bench is."""

    bench: str
    driver: ProcessId = field(default_factory=ProcessId)
    socket: str = ""  #: of that process, for stops
    guardian: ProcessId = field(default_factory=ProcessId)
    guardian_socket: str = ""
    simulated: bool = False  #: whether the instruments are in the process itself, and end with it
    document: dict[str, object] = field(default_factory=dict)  #: the bench file, for a stop at the instruments
    left: str = ""  #: how the bench was left, once its process has ended in order
    left_safe: bool = False


@dataclass(frozen=True)
class BenchPlace:
    """The folder of one bench."""

    folder: Path

    @property
    def name(self) -> str:
        """The name of the bench."""
        return unquote(self.folder.name)

    @property
    def latch(self) -> StopLatch:
        """The latch of the bench."""
        return StopLatch(self.folder)

    def note(self) -> DriverNote | None:
        """Return who drives the bench; None where no process ever wrote that down, or it cannot be read."""
        try:
            note_fields = json.loads((self.folder / NOTE).read_bytes())
            driver, guardian = ProcessId(**note_fields.pop("driver")), ProcessId(**note_fields.pop("guardian"))
            return DriverNote(driver=driver, guardian=guardian, **note_fields)
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            return None

    def write_note(self, note: DriverNote) -> None:
        """Write down who drives the bench. Raises OSError."""
        self.folder.mkdir(parents=True, exist_ok=True, mode=FOLDER)
        _write(self.folder / NOTE, asdict(note))

    def register(self) -> None:
        """Register this bench for a stop without the database; raises nothing: the bench can still be named."""
        with contextlib.suppress(OSError, RuntimeError):
            pointers = state_folder() / POINTERS
            pointers.mkdir(parents=True, exist_ok=True, mode=FOLDER)
            _write(pointers / f"{_short(str(self.folder))}.json", {"folder": str(self.folder)})


def place_of(location: str, bench: str) -> BenchPlace:
    """Return the folder of a bench of a database, by path or URL."""
    return BenchPlace(_benches_of(location) / folder_name(bench))


def folder_name(bench: str) -> str:
    """Return the name of a bench's folder."""
    return quote(bench, safe=" ").replace(".", "%2E")


def places_of(location: str) -> list[BenchPlace]:
    """Return the folders of every bench that was driven with a database."""
    return _inside(_benches_of(location))


def known_places() -> list[BenchPlace]:
    """Return the folders of every bench that this user has driven and whose folder is still there."""
    places = []
    with contextlib.suppress(OSError, RuntimeError):
        for pointer in sorted((state_folder() / POINTERS).glob("*.json")):
            with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
                folder = Path(json.loads(pointer.read_bytes())["folder"])
                if folder.is_dir():
                    places.append(BenchPlace(folder))
                else:
                    pointer.unlink()  # the database was removed, and its benches' folders with it
    return places


def state_folder() -> Path:
    """Return the folder for what outlives a process: systemd's, XDG's, or that in the home folder."""
    if state_directory := os.environ.get("STATE_DIRECTORY", ""):
        return Path(state_directory.partition(":")[0])
    named = os.environ.get("XDG_STATE_HOME", "")
    return (Path(named) if named.startswith("/") else Path.home() / ".local" / "state") / "labctl"


def _benches_of(location: str) -> Path:
    if "://" in location:
        return state_folder() / "servers" / _short(_without_password(location))
    return Path(f"{os.path.abspath(location)}.benches")  # noqa: PTH100  the name as it is, links not followed


def _inside(folder: Path) -> list[BenchPlace]:
    with contextlib.suppress(OSError):
        return [BenchPlace(each) for each in sorted(folder.iterdir()) if each.is_dir()]
    return []


def _without_password(url: str) -> str:
    scheme, _, rest = url.partition("://")
    user, at, host = rest.rpartition("@")
    return f"{scheme}://{user.partition(':')[0]}{at}{host}"


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _write(path: Path, document: dict[str, Any]) -> None:
    """Write a file that only its owner reads, as a whole or not at all."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as made:
            json.dump(document, made)
        Path(name).replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise


def _started(pid: int) -> int | None:
    """Return when a process started, in clock ticks; None for one that has ended (proc(5), stat, fields 3 and 22)."""
    fields = _fields(pid)
    try:
        return None if fields[0] in {"Z", "X"} else int(fields[19])
    except IndexError:
        return None


def _fields(pid: int) -> list[str]:
    """Return what is known of a process from its state on (proc(5), stat, field 3); nothing for one that is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="latin-1").rpartition(")")[2].split()
    except OSError:
        return []


def _boot() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except OSError:
        return ""
