"""What the studies of stops share: simulated instruments at the end of a wire, and what their table heard and when."""

from __future__ import annotations

import contextlib
import json
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import tomli_w

from instruments.bench_config import read_bench

#: What the table hears as a stop, and what lets it move: homing and moves.
ABORT = "!1a"
MOVES = re.compile(r"!1[hm]\d")
#: How often the log is read, s.
POLL_INTERVAL_S = 0.005
RECIPE = """
format = "labctl-recipe/1"
name = "stops"
temperatures_c = [25]
rates_dps = [-40, 40]
positions = ["z"]
[soak]
hold_s = 1
max_drift_c = 5.0
drift_window_s = 2
timeout_s = 600
[acquire]
duration_s = 3000
settle_s = 1
"""


@dataclass(frozen=True)
class Heard:
    """What an instrument heard, and when that was read in the log, s of the monotonic clock."""

    at_s: float
    device: str
    text: str
    table_turns: bool

    @property
    def is_stop(self) -> bool:
        """Whether the table was commanded to stop."""
        return self.device == "table" and ABORT in self.text

    @property
    def shows_motion(self) -> bool:
        """Whether the table turned, or was commanded to move: during homing the log does not say that it turns."""
        return self.table_turns or (self.device == "table" and bool(MOVES.search(self.text)))


class Table:
    """The log of the simulated instruments, read as it grows."""

    def __init__(self, log: Path) -> None:
        self.heard: list[Heard] = []
        self._log, self._over = log, threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        while not self._log.exists():
            if self._over.wait(POLL_INTERVAL_S):
                return
        with self._log.open(encoding="utf-8") as log:
            rest = ""
            while not self._over.wait(POLL_INTERVAL_S):
                rest += log.read()
                *lines, rest = rest.split("\n")
                now_s = time.monotonic()
                for line in lines:
                    said = json.loads(line)
                    self.heard.append(Heard(now_s, said["device"], said["heard"], said["table_turns"]))

    def turns(self) -> bool:
        """Return whether the table turned when an instrument heard something last."""
        return bool(self.heard and self.heard[-1].table_turns)

    def told_s(self, after: int) -> float | None:
        """Return when the table was commanded to stop, or stood, after so many lines; None where it did neither."""
        return next((line.at_s for line in self.heard[after:] if line.is_stop or not line.table_turns), None)

    def close(self) -> None:
        """Read no more."""
        self._over.set()
        self._thread.join()


@contextmanager
def simulators(folder: Path, speed: float = 1.0) -> Iterator[tuple[Path, Table]]:
    """Run the simulated instruments in a process of their own; gives the bench file and the table's log."""
    near, far, log = folder / "near.toml", folder / "far.toml", folder / "heard"
    near.write_text(tomli_w.dumps(read_bench("single-axis-sim").model_dump(exclude_none=True)))
    command = [sys.executable, "-m", "labctl", "simulator", str(near), "--out", str(far), "--log", str(log)]
    table = Table(log)
    with subprocess.Popen([*command, "--speed", str(speed), "--json"], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            yield far, table
        finally:
            process.terminate()
            table.close()


def family(mark: str) -> tuple[int, ...]:
    """Return the processes whose environment contains a text, without those that have ended."""
    found = set()
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError, IndexError):
            pid, words = int(entry.name), (entry / "environ").read_bytes()
            state = (entry / "stat").read_text(encoding="latin-1").rpartition(")")[2].split()[0]
            if mark.encode() in words and state not in {"Z", "X"} and pid != os.getpid():
                found.add(pid)
    return tuple(sorted(found))
