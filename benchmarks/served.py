"""A service as a person starts it, in a process of its own, for the benchmarks that send requests to it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

TICKS_PER_S = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Served:
    """A running `labctl serve`."""

    url: str
    process: int
    web: tuple[int, ...]  #: processes that answer over HTTP

    @property
    def port(self) -> int:
        """Where it listens, on loopback."""
        return int(self.url.rsplit(":", 1)[1])

    def processor_s(self) -> float:
        """Return the processor time it has taken since its start, s."""
        fields = Path(f"/proc/{self.process}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


@contextmanager
def serve(database: Path | str, *options: str) -> Iterator[Served]:
    """Serve a database until the block ends; its cache is in a folder of its own, so it is empty at the start."""
    words = ["serve", "--port", "0", "--json", "--database", str(database), *options]
    command = [sys.executable, "-m", "labctl", *words]
    with (
        tempfile.TemporaryDirectory() as cache,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env={**os.environ, "XDG_CACHE_HOME": cache}
        ) as service,
    ):
        assert service.stdout is not None
        try:
            ready = json.loads(next(line for line in service.stdout if '"url"' in line))
            yield Served(ready["url"], service.pid, tuple(ready["web_pids"]))
        finally:
            service.terminate()
