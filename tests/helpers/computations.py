"""Work for computations, which a worker process finds by its name, and the end of a worker as a pipe shows it."""

from __future__ import annotations

import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from labctl.acting_user import actor
from labctl.progress import report_stage
from labctl.services.cache import UNNAMED, compute
from labctl.store import Store, StoreAddress, open_store

BEGUN = b"begun\n"
#: Variable of the environment that names the pipe of `hold_request`.
PIPE = "HELD_BY_A_TEST"


def who_asks(_: Store, answer: str, *, again: int = 1) -> tuple[str, str]:
    """Return the answer some times over and in whose name this runs, after two stages."""
    report_stage("first")
    report_stage("second")
    return answer * again, actor().name


def serials(store: Store) -> list[str]:
    """Return the serial numbers of the store."""
    return [unit.serial for unit in store.units.all()]


def fail_with(_: Store, error: Exception) -> None:
    """Raise an error."""
    raise error


def take_memory(_: Store, mib: int) -> int:
    """Take so much memory, and return its size."""
    return len(bytearray(mib << 20))


def die(_: Store) -> None:
    """End this process as the system does where memory is short."""
    os.kill(os.getpid(), signal.SIGKILL)


def die_in_a_worker(store: Store, *_: object, **__: object) -> None:
    """In place of what a request asks for: end the process that computes it."""
    compute(UNNAMED)
    die(store)


def hold_request(store: Store, *_: object, **__: object) -> None:
    """In place of what a request asks for: hold the process that computes it, as `hold` does."""
    compute(UNNAMED)
    hold(store, os.environ[PIPE])


def surroundings(_: Store) -> tuple[int, int, str | None, list[str]]:
    """Return niceness, address space limit, one variable of the environment, and what is open."""
    opened = [str(link.readlink()) for link in Path("/proc/self/fd").iterdir() if link.exists()]
    return os.nice(0), resource.getrlimit(resource.RLIMIT_AS)[0], os.environ.get("XDG_CACHE_HOME"), opened


def hold(_: Store, pipe: str) -> None:
    """Write into a named pipe that this has begun, and go on until the process ends."""
    report_stage("held")
    with Path(pipe).open("wb", buffering=0) as reported:
        reported.write(BEGUN)
        while True:
            signal.pause()


class Held:
    """A worker that does `hold`, seen through its pipe."""

    def __init__(self, folder: Path) -> None:
        self.pipe = str(folder / "held")
        os.mkfifo(self.pipe)

    def wait_for_begin(self) -> None:
        """Return when the work has begun."""
        self._reported = Path(self.pipe).open("rb", buffering=0)  # noqa: SIM115  closed at its end
        assert self._reported.read(len(BEGUN)) == BEGUN

    def close(self) -> None:
        """Look no more."""
        self._reported.close()

    def wait_for_end(self) -> None:
        """Return when the process has ended."""
        with self._reported:
            assert self._reported.read() == b""


class Writable(StoreAddress):
    """An address by which a worker writes to an SQLite file that no process holds."""

    @property
    def can_write(self) -> bool:
        """As the address of a process that writes for others."""
        return True

    @contextmanager
    def open(self) -> Iterator[Store]:
        """Open the store for writing."""
        with open_store(self.location, write=True) as store:
            yield store


def process(_: Store) -> int:
    """Return the number of the process that does this."""
    return os.getpid()
