"""Two real processes, one bench on real ports: the second is refused, takes over after a kill, never do both move."""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from instruments.bench_config import read_bench

SPEED = 20.0
#: The rates tell on the wire which of the two drives: each has its own divisor of the step clock.
FIRST_DPS, SECOND_DPS = 40, 30
RECIPE = """
format = "labctl-recipe/1"
name = "drive-{rate}"
temperatures_c = [25]
rates_dps = [-{rate}, {rate}]
positions = ["z"]
[soak]
hold_s = 30
max_drift_c = 2.0
drift_window_s = 30
timeout_s = 1800
[acquire]
duration_s = 20000
settle_s = 2
"""
WAIT_S = 100


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
        command = [sys.executable, "-m", "labctl", "simulator", str(near), "--out", str(self.bench)]
        self.process = subprocess.Popen(
            [*command, "--speed", str(SPEED), "--log", str(pipe), "--json"], stdout=subprocess.PIPE, text=True
        )
        self.heard: list[dict[str, Any]] = []
        self._table: queue.Queue[dict[str, Any]] = queue.Queue()
        self._reader = threading.Thread(target=self._read, args=(pipe,), daemon=True)
        self._reader.start()
        assert self.process.stdout is not None
        json.loads(self.process.stdout.readline())

    def _read(self, pipe: Path) -> None:
        with pipe.open() as lines:
            for line in lines:
                said = json.loads(line)
                self.heard.append(said)
                if said["device"] == "table":
                    self._table.put(said)

    def wait_for(self, begin: str) -> None:
        """Wait until the table hears a command."""
        while not self._table.get(timeout=WAIT_S)["heard"].startswith(begin):
            pass

    def drive(self, rate_dps: int, database: str) -> subprocess.Popen[str]:
        """Start a campaign that turns the table for longer than the test lasts."""
        recipe = self.folder / f"drive-{rate_dps}.toml"
        recipe.write_text(RECIPE.format(rate=rate_dps))
        command = [
            sys.executable,
            "-m",
            "labctl",
            "campaign",
            "start",
            str(recipe),
            "--bench",
            str(self.bench),
            "--json",
        ]
        driver = subprocess.Popen(
            [*command, "--database", str(self.folder / database)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._drivers.append(driver)
        return driver

    def refused(self, database: str) -> str:
        """Let the second one try; returns what it says."""
        second = self.drive(SECOND_DPS, database)
        _, said = second.communicate(timeout=WAIT_S)
        assert second.returncode == 2, said
        return said

    def close(self) -> None:
        for driver in self._drivers:
            driver.kill()  # those that a failed test has left
            driver.communicate()
        self.process.terminate()
        self.process.wait()
        self._reader.join(WAIT_S)
        self._drivers.clear()
        assert self.process.stdout is not None
        self.process.stdout.close()


@pytest.fixture
def simulator(tmp_path: Path) -> Iterator[Simulator]:
    made = Simulator(tmp_path)
    yield made
    made.close()


def speed_command(rate_dps: float) -> str:
    """What the table hears before it turns so fast."""
    return f"!1sp1,{round(2_000_000 * 0.225 / rate_dps)}"


@pytest.mark.timeout(400)
def test_the_second_is_refused_and_takes_over_when_the_first_is_killed(simulator: Simulator) -> None:
    first = simulator.drive(FIRST_DPS, "lab.sqlite")
    simulator.wait_for("!1m1")
    first.send_signal(signal.SIGSTOP)  # it hangs, while its table turns: nothing that it could do ends this by itself
    held = f"bench single-axis-sim is held by process {first.pid} on "
    assert held in simulator.refused("lab.sqlite")
    # another database knows nothing of that lease, but the ports are taken
    said = simulator.refused("other.sqlite")
    assert "table: port /dev/" in said
    assert "exclusively lock" in said
    heard_before_the_kill = len(simulator.heard)
    first.send_signal(signal.SIGKILL)
    first.wait(timeout=WAIT_S)
    assert "labctl campaign abort 1" in simulator.refused("lab.sqlite")  # a person decides about what was left
    for decided in (["campaign", "abort", "1"], ["bench", "clear", "single-axis-sim", "--by", "Ada"]):
        command = [sys.executable, "-m", "labctl", *decided, "--database", str(simulator.folder / "lab.sqlite")]
        subprocess.run(command, check=True, capture_output=True)
    second = simulator.drive(SECOND_DPS, "lab.sqlite")
    simulator.wait_for(speed_command(SECOND_DPS))
    simulator.wait_for("!1m1")
    second.send_signal(signal.SIGTERM)
    assert second.wait(timeout=WAIT_S) == 130
    simulator.close()
    by = [
        [at for at, line in enumerate(simulator.heard) if line["heard"].startswith(speed_command(rate))]
        for rate in (FIRST_DPS, SECOND_DPS)
    ]
    assert max(by[0]) < heard_before_the_kill <= min(by[1])
    table = [line for line in simulator.heard if line["device"] == "table"]
    aborts = [line for line in table if line["heard"].startswith("!1a")]
    assert [line["table_turns"] for line in aborts[:2]] == [True, True]  # the killed one's last move, then its own
    moves = [line for line in table if line["heard"].startswith(("!1m1", "!1h1"))]
    assert moves
    assert not any(line["table_turns"] for line in moves), moves
