"""Three benches and three services on one PostgreSQL server: a service killed, the server restarted, a network cut.

`LABCTL_STUDY_CUT_S` is for how long the network between one service and the server is cut. Each bench is simulated
instruments in a process of their own, whose log says what the table heard: a move that is commanded while the table
turns comes from a second driver.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import sqlalchemy as sa
import tomli_w

from instruments.bench_config import read_bench
from labctl.answers.campaigns import BENCH_CHECKS
from labctl.store import open_store
from labctl.store.connection.database import Database
from labctl.store.schema import tables
from studies.crashable_process import all_readings
from studies.databases import close_server, server
from studies.network_cut import Network, network_to
from studies.stop_rig import ABORT, MOVES, Table, family

CUT_S = float(os.environ.get("LABCTL_STUDY_CUT_S", "60"))
SPEED = 5.0
DATA_SETS, DURATION_S, SAMPLE_RATE_HZ = 10, 60.0, 10.0
#: A busy machine may stall for seconds, which at five times its pace a bench takes for a silent instrument.
RECIPE = f"""
format = "labctl-recipe/1"
name = "benches"
temperatures_c = [25]
rates_dps = [-40, -30, -20, -10, 0, 10, 20, 25, 30, 40]
positions = ["z"]
[soak]
hold_s = 10
max_drift_c = 2.0
drift_window_s = 10
timeout_s = 1800
[acquire]
duration_s = {DURATION_S}
settle_s = 2
[guards]
max_damaged_fraction = 0.9
stale_s = 1200
[on_failure]
acquire_attempts = 20
"""
NAMES = ("bench-a", "bench-b", "bench-c")
KILLED, CUT = 1, 2
POLL_INTERVAL_S, REQUEST_S, WITHIN_S = 0.2, 30.0, 500.0


@dataclass
class Bench:
    """One bench, its service, and what its table heard."""

    name: str
    file: Path
    table: Table
    network: Network
    database: str  #: through its own network
    campaign: int = 0
    url: str = ""
    starts: list[int] = field(default_factory=list)  #: length of the log when its service was started

    @property
    def mark(self) -> str:
        """What the environment of the processes of its service contains."""
        return f"LABCTL_STUDY_SERVICE={self.file}"

    def serve(self) -> None:
        """Start its service; returns when that answers."""
        self.starts.append(len(self.table.heard))
        command = [sys.executable, "-m", "labctl", "serve", "--bench", str(self.file), "--port", "0", "--json"]
        environment = {**os.environ, "LABCTL_STUDY_SERVICE": str(self.file)}
        with (self.file.parent / "said").open("ab") as said:
            process = subprocess.Popen(
                [*command, "--database", self.database], env=environment, stdout=subprocess.PIPE, stderr=said, text=True
            )
        assert process.stdout is not None
        self.url = json.loads(process.stdout.readline())["url"]

    def kill(self) -> None:
        """End all processes of its service at once."""
        while pids := family(self.mark):
            for pid in pids:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)

    def get(self, path: str) -> Any:
        """Ask its service; None where that does not answer."""
        with suppress(httpx.TransportError, ValueError):
            answer = httpx.get(self.url + path, timeout=REQUEST_S)
            return answer.json() if answer.status_code == httpx.codes.OK else None
        return None

    def start(self) -> None:
        """Start its campaign."""
        body = {"recipe": RECIPE, "confirmed_by": "the study", "checks": list(BENCH_CHECKS)}
        answer = httpx.post(f"{self.url}/api/campaigns", json=body, timeout=REQUEST_S).raise_for_status()
        self.campaign = int(answer.json()["id"])

    @property
    def moves_while_turning(self) -> int:
        """How often the table was commanded to move while it turned: only a second driver does that."""
        heard = [line for line in self.table.heard if line.device == "table"]
        return sum(bool(MOVES.search(line.text)) and line.table_turns for line in heard)

    @property
    def begins_with_a_stop(self) -> bool:
        """Whether the first command of each service that found a campaign on the bench was a stop, before any move."""
        for start in self.starts[1:]:
            said = [line.text for line in self.table.heard[start:] if line.device == "table"]
            stop, move = (
                next((number for number, text in enumerate(said) if found(text)), len(said))
                for found in (lambda text: ABORT in text, MOVES.search)
            )
            if move < stop:
                return False
        return True

    def stood_after_s(self, since_s: float) -> float:
        """Wait until the table stands, or is stopped; returns how long after an instant that was, s."""
        wait(lambda: any(line.is_stop or not line.table_turns for line in self.table.heard if line.at_s > since_s))
        return next(
            line.at_s - since_s
            for line in self.table.heard
            if line.at_s > since_s and (line.is_stop or not line.table_turns)
        )


def wait(holds: Callable[[], bool]) -> None:
    """Wait until something holds. Raises TimeoutError."""
    end_s = time.monotonic() + WITHIN_S
    while not holds():
        if time.monotonic() > end_s:
            raise TimeoutError
        time.sleep(POLL_INTERVAL_S)


@contextmanager
def bench(folder: Path, name: str, database: str) -> Iterator[Bench]:
    """Run the simulated instruments of one bench, its network and, once started, its service."""
    made = read_bench("single-axis-sim").model_dump(exclude_none=True)
    made["name"], made["gyros"][0]["serial"] = name, f"FOG-{name}"
    near, far, log = folder / "near.toml", folder / "far.toml", folder / "heard"
    near.write_text(tomli_w.dumps(made))
    command = [sys.executable, "-m", "labctl", "simulator", str(near), "--out", str(far), "--log", str(log)]
    with ExitStack() as opened:
        network = opened.enter_context(network_to(server().socket))
        table = Table(log)
        opened.callback(table.close)
        process = opened.enter_context(
            subprocess.Popen([*command, "--speed", str(SPEED), "--json"], stdout=subprocess.PIPE, text=True)
        )
        opened.callback(process.terminate)
        assert process.stdout is not None
        process.stdout.readline()
        url = sa.make_url(database).set(host="127.0.0.1", port=network.port, query={})
        one = Bench(name, far, table, network, url.render_as_string(hide_password=False))
        opened.callback(one.kill)
        yield one


def counts(database: str) -> dict[int, dict[int, list[int]]]:
    """Return for each campaign and data set of its plan the readings of each complete data set."""
    r, d = tables.recordings.c, tables.data_sets.c
    opened, found = Database(database, write=False), {}
    query = sa.select(r.campaign_id, d.planned, d.n).where(d.state == "complete", d.recording_id == r.id)
    with opened.reading() as connection:
        for campaign, planned, n in connection.execute(query):
            found.setdefault(campaign, {}).setdefault(planned, []).append(n)
    opened.close()
    return found


def readings(database: str) -> set[tuple[int, int, int]]:
    """Return every reading that is stored."""
    opened = Database(database, write=False)
    found = all_readings(opened)
    opened.close()
    return found


def disturb(benches: list[Bench], database: str) -> tuple[dict[str, float], set[tuple[int, int, int]]]:
    """Kill one service, restart the server, and cut the network of another; returns times, and readings before."""
    wait(lambda: all(each.table.turns() for each in benches))
    killed, cut = benches[KILLED], benches[CUT]
    killed.kill()
    at_s, before = time.monotonic(), readings(database)
    wait(lambda: _says_gone(benches[0], killed.name))
    gone_s = time.monotonic() - at_s
    killed.serve()
    stood_s = killed.stood_after_s(at_s)
    server().stop()
    server().start()
    wait(cut.table.turns)
    before |= readings(database)
    cut.network.cut()
    at_s = time.monotonic()
    threading.Timer(CUT_S, cut.network.mend).start()
    interrupted_s = cut.stood_after_s(at_s + 10.0) + 10.0  # between two data sets it stands for a moment
    before |= readings(database)
    times = {"gone_known_after_s": gone_s, "killed_stood_after_s": stood_s, "cut_stood_after_s": interrupted_s}
    return times, before


def _says_gone(asked: Bench, name: str) -> bool:
    states = asked.get("/api/benches/status") or []
    return any(each["name"] == name and each["driver"] and not each["driver"]["alive"] for each in states)


def _is_over(each: Bench) -> bool:
    found = each.get(f"/api/campaigns/{each.campaign}")
    return found is not None and found["state"] in {"done", "failed", "aborted"}


def run() -> dict[str, float]:
    """Run three campaigns at once through a kill, a restart of the server and a cut network."""
    database = server().new_database()
    with tempfile.TemporaryDirectory() as name, ExitStack() as opened:
        benches = []
        for each in NAMES:
            (folder := Path(name) / each).mkdir()
            benches.append(opened.enter_context(bench(folder, each, database)))
        for each in benches:
            each.serve()
        for each in benches:
            each.start()
        times, before = disturb(benches, database)
        wait(lambda: all(_is_over(each) for each in benches))
        with open_store(database, write=False) as store:
            rows = [store.campaigns.get(each.campaign) for each in benches]
            audit_broken = store.audit.first_broken() is not None
            unconfirmed = sum(bool(row.unconfirmed) for row in store.benches.all())
        for row in rows:
            print(f"   {row.bench_name}: {row.state.value}: {row.reason}", flush=True)
        found = counts(database)
        numbers = range(1, DATA_SETS + 1)
        planned = [found.get(each.campaign, {}).get(number, []) for each in benches for number in numbers]
        rates = [n / (DURATION_S * SAMPLE_RATE_HZ) for each in planned for n in each]
        figures = {
            "campaigns_done": float(sum(row.state.value == "done" for row in rows)),
            "readings_missing": float(len(before - readings(database))),
            "data_sets_twice_or_missing": float(sum(len(each) != 1 for each in planned)),
            "least_readings_of_expected": min(rates),
            "most_readings_of_expected": max(rates),
            "moves_while_turning": float(sum(each.moves_while_turning for each in benches)),
            "restarts_that_did_not_begin_with_a_stop": float(sum(not each.begins_with_a_stop for each in benches)),
            "benches_unconfirmed": float(unconfirmed),
            "audit_broken": float(audit_broken),
            **times,
        }
    close_server()
    return figures
