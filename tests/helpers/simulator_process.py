"""`labctl simulator` in a real process, on real pseudo-terminals and TCP ports, and campaigns that drive it."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import threading
from pathlib import Path
from typing import Any

import tomli_w

from instruments.bench_config import read_bench
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import begin, begin_loaded, first_line, kill, labctl

#: Time-outs are seconds of the bench. The faster it runs, the shorter the stall of a busy machine that breaks a link.
SPEED = 4.0
#: The rates tell on the wire which of two processes drives: each has its own divisor of the step clock.
FIRST_DPS, SECOND_DPS = 40, 30
RECIPE = """
format = "labctl-recipe/1"
name = "drive-{rate}"
temperatures_c = [25]
rates_dps = [-{rate}, {rate}]
positions = ["z"]
[soak]
hold_s = 1
max_drift_c = 2.0
drift_window_s = 1
timeout_s = 1800
[acquire]
duration_s = 20000
settle_s = 2
"""


def bench_toml() -> str:
    """A gyro on two serial lines, and a chamber on the network."""
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    bench["chamber"] = read_bench("triaxial-sim").model_dump(exclude_none=True)["chamber"]
    return tomli_w.dumps(bench)


class Simulator:
    """`labctl simulator` in a process of its own, and what its instruments hear as it comes."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.bench = folder, folder / "far.toml"
        self._drivers: list[subprocess.Popen[str]] = []
        near, pipe = folder / "near.toml", folder / "log"
        near.write_text(bench_toml())
        os.mkfifo(pipe)
        command = ["simulator", str(near), "--out", str(self.bench), "--speed", str(SPEED)]
        self.process = begin_loaded([*command, "--log", str(pipe), "--json"])
        self.heard: list[dict[str, Any]] = []
        self._table: queue.Queue[dict[str, Any]] = queue.Queue()
        self._reader = threading.Thread(target=self._read, args=(pipe,), daemon=True)
        self._reader.start()
        json.loads(first_line(self.process))

    def _read(self, pipe: Path) -> None:
        with pipe.open() as lines:
            for line in lines:
                said = json.loads(line)
                self.heard.append(said)
                if said["device"] == "table":
                    self._table.put(said)

    def wait_for(self, command: str) -> None:
        """Wait until the table hears a command."""
        heard = ""
        while not heard.startswith(command):
            try:
                heard = self._table.get(timeout=WAIT_S)["heard"]
            except queue.Empty:
                raise AssertionError(f"the table never heard {command}; {self._said_by_drivers()}") from None

    def _said_by_drivers(self) -> str:
        for driver in self._drivers:
            driver.terminate()
        return "\n".join(text for driver in self._drivers for text in driver.communicate(timeout=WAIT_S))

    def drive(self, rate_dps: int, database: str, *, loads: bool = False) -> subprocess.Popen[str]:
        """Start a campaign that turns the table for longer than the test lasts.

        With `loads` its process loads its modules; otherwise it is forked from one that has loaded them.
        """
        recipe = self.folder / f"drive-{rate_dps}.toml"
        recipe.write_text(RECIPE.format(rate=rate_dps))
        clear = ("--clear-confirmed-by", "a test")  # what is far is not known to be simulated
        command = labctl(self.folder / database, "campaign", "start", str(recipe), "--bench", str(self.bench), "--json")
        driver = begin([*command, *clear]) if loads else begin_loaded([*command[3:], *clear])
        self._drivers.append(driver)
        return driver

    def refused(self, database: str) -> str:
        """Let the second one try; returns what it says."""
        second = self.drive(SECOND_DPS, database)
        _, said = second.communicate(timeout=WAIT_S)
        assert second.returncode == 2, said
        return said

    def close(self) -> None:
        """End the simulator, and what a failed test has left of its drivers; afterwards `heard` is complete."""
        for driver in self._drivers:
            kill(driver)
        self._drivers.clear()
        self.process.terminate()
        self.process.communicate(timeout=WAIT_S)
        self._reader.join(WAIT_S)
