"""Settings of `labctl serve`, as each of its processes needs them."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from labctl.config import default_database
from labctl.errors import BadInput
from labctl.stop.page import PageAccess
from labctl.texts import NO_BENCH

SIMULATED_BENCH = "triaxial-sim"
LAST_PORT = 65535
MAX_PROCESSES = 64
#: Names of the sockets in the folder of a bench process.
CALLS, STOP = "calls", "stop"
#: Name of the file in that folder with the digests of the keys, for a process that answers without a database.
KEYS = "keys.json"
LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "[::1]"})


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches an address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@dataclass(frozen=True)
class ServeRequest:
    """What to serve, and where."""

    bench: str | None = None
    simulate: bool = False
    speed: float = 1.0  #: of a simulated bench; 0: as fast as it can
    simulated_start: datetime | None = None  #: aware instant at which a service with a simulated bench begins
    host: str = "127.0.0.1"
    port: int = 8420
    database: str | None = None
    require_keys: bool = False
    max_upload_mib: int = 2048
    wire_logs: Path | None = None  #: folder for a log of each campaign
    read_only: bool = False  #: drive no bench, and change nothing in the database
    acts_at: str | None = None  #: address of the service that acts, which one that only reads names
    processes: int = 1  #: web processes of a service that only reads

    @property
    def location(self) -> str:
        """The database: a URL, or a path that means the same in every process."""
        return self.database or default_database()

    @property
    def asks_for_keys(self) -> bool:
        """Whether a request needs a key: off loopback always."""
        return self.require_keys or not is_loopback(self.host)

    @property
    def bench_name(self) -> str | None:
        """The bench to drive, if any."""
        return self.bench or (SIMULATED_BENCH if self.simulate else None)

    def check(self) -> None:
        """Raise BadInput for a number that is out of its range, and for options that exclude each other."""
        self._check_reading()
        if not 0 <= self.speed < float("inf"):
            raise BadInput(f"--speed {self.speed}: give a positive number, or 0 for as fast as possible")
        if self.simulated_start is not None and self.bench_name is None:
            raise BadInput(
                f"--simulated-start {self.simulated_start.isoformat()}: this service has no simulated bench; give "
                "--simulate, or leave the option out"
            )
        if self.wire_logs is not None and self.bench_name is None:
            raise BadInput(
                f"--wire-logs {self.wire_logs}: {NO_BENCH}; give --bench or --simulate, or leave the option out"
            )
        if not 0 <= self.port <= LAST_PORT:
            raise BadInput(f"--port {self.port}: give a port from 1 to {LAST_PORT}, or 0 for a free port")
        if not 1 <= self.max_upload_mib <= 1 << 20:
            raise BadInput(f"--max-upload-mib {self.max_upload_mib}: give a size from 1 to {1 << 20} MiB")

    def _check_reading(self) -> None:
        if self.read_only and self.bench_name is not None:
            raise BadInput(
                f"--read-only: a service that only reads drives no bench, but {self.bench_name} is named; leave "
                "--bench and --simulate out, or leave --read-only out"
            )
        if not self.read_only and self.acts_at is not None:
            raise BadInput(f"--acts-at {self.acts_at}: this service acts itself; give --read-only, or leave it out")
        if self.acts_at is not None and not self.acts_at.startswith(("http://", "https://")):
            raise BadInput(f"--acts-at {self.acts_at}: give an address that begins with http:// or https://")
        if not 1 <= self.processes <= MAX_PROCESSES:
            raise BadInput(f"--processes {self.processes}: give a number from 1 to {MAX_PROCESSES}")
        if self.processes > 1 and not self.read_only:
            raise BadInput(
                f"--processes {self.processes}: a service that may write has one web process; give --read-only, or "
                "leave the option out"
            )


@dataclass(frozen=True)
class BenchSettings:
    """Settings of the bench process. Two with equal `drives` drive the same bench in the same way."""

    location: str
    bench: str | None
    simulate: bool
    speed: float
    folder: Path  #: of its sockets
    url: str  #: of the web process
    simulated_start: datetime | None = None
    ahead: timedelta = timedelta()  #: how far the simulated date is ahead of this computer's
    guardian_pid: int = 0  #: the supervisor, which stops the bench where the bench process does not
    guardian_socket: str = ""
    host: str = "127.0.0.1"  #: at which the service listens
    at: str = "127.0.0.1"  #: that address, as a Host header names it
    asks_for_keys: bool = False  #: whether a request needs a key
    wire_logs: Path | None = None  #: folder for a log of each campaign

    @property
    def drives(self) -> tuple[str, str | None, float, datetime | None]:
        """The database, the bench, its pace and its date."""
        return self.location, self.bench, self.speed, self.simulated_start

    @property
    def page_access(self) -> PageAccess:
        """Access to a stop at the address of the service while no web process answers there."""
        return page_access(self.asks_for_keys, self.at, self.folder)


def page_access(asks_for_keys: bool, at: str, folder: Path) -> PageAccess:
    """Return the access to a stop at the address of a service while no web process answers there."""
    return PageAccess(LOOPBACK_NAMES | {at.lower()}, folder / KEYS if asks_for_keys else None)


@dataclass(frozen=True)
class WebSettings:
    """Settings of the web process."""

    request: ServeRequest
    folder: Path  #: of the bench process's sockets
    listener: int  #: file descriptor of the socket that listens for HTTP
    at: str  #: the address, as a Host header names it
    ahead: timedelta = timedelta()  #: how far the simulated date is ahead of this computer's


def ahead_of(now: datetime, simulated_start: datetime | None) -> timedelta:
    """Return how far a simulated date is ahead of the present, both aware; zero where none is simulated."""
    return timedelta() if simulated_start is None else simulated_start.astimezone(UTC) - now
