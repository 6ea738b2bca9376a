"""A private PostgreSQL cluster in a temporary folder, on a Unix socket: no server of the machine is touched."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

#: Where Debian keeps the programs of a server.
DEBIAN = Path("/usr/lib/postgresql")
USER = "labctl"
#: More than a server needs to start on a busy machine, s.
START_S = 120


def programs() -> Path | None:
    """Return the folder of the newest server's programs; None without one."""
    found = sorted(DEBIAN.glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    if found:
        return found[-1].parent
    where = shutil.which("initdb")
    return None if where is None else Path(where).parent


#: The port that names the socket of a cluster, and that of its replica.
PORT, REPLICA_PORT = 5432, 5433


class Server:
    """A server of a folder. PostgreSQL refuses to run as root, so as root it runs as the package's own user."""

    def __init__(self, folder: Path, bin_folder: Path, data: str, port: int) -> None:
        self._folder, self._bin, self._port = folder, bin_folder, port
        self._data, self._sockets = folder / data, folder / "s"
        self._user = "postgres" if os.geteuid() == 0 else None

    def _run(self, program: str, *arguments: object) -> None:
        command = [str(self._bin / program), *map(str, arguments)]
        with (self._folder / "said").open("ab") as said:
            subprocess.run(command, user=self._user, check=True, cwd="/", stdout=said, stderr=said, timeout=START_S)

    def start(self) -> None:
        """Start the server; it answers when this returns.

        It does not wait for the disk (fsync off): the studies let the server crash, but not the machine.
        """
        settings = {
            "listen_addresses": "''",
            "unix_socket_directories": self._sockets,
            "port": self._port,
            "max_connections": 200,
            "fsync": "off",
        }
        options = " ".join(f"-c {name}={value}" for name, value in settings.items())
        self._run("pg_ctl", "-D", self._data, "-w", "-t", START_S, "-l", f"{self._data}.log", "-o", options, "start")

    def stop(self, *, how: str = "fast") -> None:
        """Stop the server: `fast` ends every connection in order, `immediate` is a crash."""
        self._run("pg_ctl", "-D", self._data, "-w", "-m", how, "stop")

    def crash(self) -> None:
        """Let the server crash and start again: what was not synced may be lost."""
        self.stop(how="immediate")
        self.start()

    def freeze(self) -> None:
        """Stop every process of the server where it is: connections stay open, and nothing is answered any more."""
        self._signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Let a frozen server go on."""
        self._signal(signal.SIGCONT)

    def _signal(self, number: signal.Signals) -> None:
        """Send a signal to the server's first process and then, as that one starts the others, to its children."""
        first = int((self._data / "postmaster.pid").read_text().split()[0])
        os.kill(first, number)
        for each in Path("/proc").glob("[0-9]*/stat"):
            with suppress(OSError):
                if int(each.read_text().rpartition(")")[2].split()[1]) == first:
                    os.kill(int(each.parent.name), number)

    def url(self, database: str = "postgres") -> str:
        """Return the URL of one of its databases."""
        return f"postgresql+psycopg://{USER}@/{database}?host={self._sockets}&port={self._port}"

    @property
    def socket(self) -> Path:
        """The Unix socket that the server listens on."""
        return self._sockets / f".s.PGSQL.{self._port}"


class Cluster(Server):
    """A server with databases of its own."""

    def __init__(self, folder: Path, bin_folder: Path) -> None:
        super().__init__(folder, bin_folder, "data", PORT)
        self._sockets.mkdir()
        if self._user is not None:
            owner = pwd.getpwnam(self._user)
            for path in (folder, self._sockets):
                os.chown(path, owner.pw_uid, owner.pw_gid)
        self._run("initdb", "-D", self._data, "-U", USER, "-A", "trust", "-E", "UTF8", "--no-sync", "--no-instructions")

    @contextmanager
    def replica(self) -> Iterator[Server]:
        """Copy the server, let the copy follow it by streaming for the block, and remove it."""
        made = Server(self._folder, self._bin, "replica", REPLICA_PORT)
        source = ("-h", self._sockets, "-p", self._port, "-U", USER)
        self._run("pg_basebackup", *source, "-D", made._data, "-R", "-X", "stream", "-c", "fast", "--no-sync")  # noqa: SLF001
        made.start()
        try:
            yield made
        finally:
            with suppress(subprocess.SubprocessError):
                made.stop(how="immediate")
            shutil.rmtree(made._data, ignore_errors=True)  # noqa: SLF001

    def new_database(self) -> str:
        """Make an empty database; returns its URL."""
        name = f"t{uuid4().hex[:12]}"
        self._run("createdb", "-h", self._sockets, "-U", USER, name)
        return self.url(name)


@contextmanager
def running_cluster(bin_folder: Path) -> Iterator[Cluster]:
    """Make a cluster, run it for the block, and remove it."""
    folder = Path(tempfile.mkdtemp(prefix="labctl-pg-", dir="/tmp"))  # a socket's path has at most 107 bytes
    folder.chmod(0o755)
    cluster = Cluster(folder, bin_folder)
    try:
        cluster.start()
        yield cluster
    finally:
        with suppress(OSError):
            cluster.thaw()  # what a failed test has left frozen cannot end
        with suppress(subprocess.SubprocessError):
            cluster.stop(how="immediate")
        shutil.rmtree(folder, ignore_errors=True)
