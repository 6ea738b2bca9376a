"""Every fault of every simulated instrument at random times: each campaign ends, safe or loudly not, losing nothing."""

from __future__ import annotations

import os
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from instruments.bench import open_bench
from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from instruments.interfaces.gyro import Readings
from instruments.simulation import Simulation, open_simulation
from instruments.simulators.links.faults import FaultKind
from labctl.services.campaigns import execution, preparation
from labctl.services.planning.loading import load_bench
from labctl.store import Store, StoreJournal
from labctl.store.connection.database import Database
from studies.crashable_process import all_readings
from studies.databases import new_database

CAMPAIGNS = int(os.environ.get("LABCTL_STUDY_FAULTS", "500"))
RECIPE = """
format = "labctl-recipe/1"
name = "faulty"
temperatures_c = [24, 27]
rates_dps = [-40, 0, 40]
positions = ["z", "-z"]
[mounting]
repower_each = true
[soak]
hold_s = 60
max_drift_c = 2.0
drift_window_s = 60
timeout_s = 1800
move_timeout_s = 1800
[acquire]
duration_s = 10
settle_s = 2
[guards]
suspend_timeout_s = 900
[guards.actions]
invalid_readings = "warn"
chamber_deviation = "suspend"
"""
EXPECTED_S = 1500.0
#: Far more than all time-outs, retries and suspensions of this recipe together.
HANGS_AFTER_S = 40 * EXPECTED_S
KINDS: tuple[FaultKind, ...] = get_args(FaultKind)


class Hung(BaseException):
    """A campaign that does not come to an end."""


class LimitedClock(VirtualClock):
    """Virtual time with an end."""

    def sleep(self, duration_s: float) -> None:
        super().sleep(duration_s)
        if self.now_s() > HANGS_AFTER_S:
            raise Hung


class CountingJournal(StoreJournal):
    """Counts what was handed over, for comparison with the database."""

    def __init__(self, database: Database, campaign: int) -> None:
        super().__init__(database, campaign)
        self.handed_over = 0

    def readings(self, dataset: int, gyro: str, readings: Readings, chamber_c: float) -> None:
        """Write a block down, and count it once that is done."""
        super().readings(dataset, gyro, readings, chamber_c)
        self.handed_over += len(readings)


@dataclass(frozen=True)
class Armed:
    """One fault as it was drawn."""

    device: str
    url: str
    kind: FaultKind
    settings: dict[str, Any]


@dataclass(frozen=True)
class End:
    """How a campaign with faults ended."""

    seed: int
    armed: tuple[Armed, ...]
    state: str
    reason: str
    hung: bool
    lost_readings: int
    safe: bool  #: table at rest and chamber at its safe set point, as the world has it
    said: bool  #: what could not be confirmed is on the bench's status

    @property
    def well(self) -> bool:
        """Whether it is done, or stopped with a reason that names a faulty device, safe or loudly not; nothing lost."""
        named = self.state == "done" or any(each.device in self.reason for each in self.armed)
        return named and not self.hung and self.lost_readings == 0 and (self.safe or self.said)


def benches() -> list[BenchFile]:
    """Return benches that have every simulated instrument between them; one carries two units."""
    single, triaxial, star = (load_bench(f"{name}-sim") for name in ("single-axis", "triaxial", "gyrostar"))
    dsp = single.gyros[0].model_copy(
        update={"name": "dsp", "driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/dsp", "serial": "DSP-1",
                "sample_rate_hz": 100.0, "datasheet": {}, "datasheet_conventions": {}}
    )  # fmt: skip
    two = single.model_copy(update={"chamber": triaxial.chamber, "gyros": (*single.gyros, dsp)})
    stim = triaxial.gyros[0].model_copy(update={"sample_rate_hz": 25.0})
    star = star.model_copy(update={"table": single.table})
    return [single, triaxial.model_copy(update={"gyros": (stim,)}), star, two]


def addresses(bench: BenchFile) -> dict[str, str]:
    """Return device -> sim:// address."""
    places = {"table": bench.table.port, "chamber": bench.chamber.port or bench.chamber.host}
    places |= {gyro.name: gyro.port or gyro.host for gyro in bench.gyros}
    return {name: str(place) for name, place in places.items()}


def draw(seed: int, bench: BenchFile) -> tuple[Armed, ...]:
    """Draw one to three faults: which device, which kind, when, for how long and how often."""
    rng = np.random.default_rng([4, seed])
    places = list(addresses(bench).items())
    armed = []
    for number in range(int(rng.integers(1, 4))):
        device, url = places[int(rng.integers(len(places)))]
        kind = KINDS[(seed + number) % len(KINDS)]
        from_s = float(rng.uniform(0, EXPECTED_S))
        lasts_s = float(rng.choice([2.0, 20.0, 200.0, np.inf]))
        count = None if rng.random() < 0.5 else int(rng.integers(1, 6))
        value = {"modbus_exception": int(rng.choice([2, 3, 4, 6])), "counter_gap": int(rng.integers(1, 40))}.get(
            kind, 3
        )
        settings = {"from_s": from_s, "until_s": from_s + lasts_s, "count": count, "value": value}
        armed.append(Armed(device, url, kind, settings))
    return tuple(armed)


def one(seed: int) -> End:
    """Run one campaign with faults."""
    bench = benches()[seed % len(benches())]
    armed = draw(seed, bench)
    with tempfile.TemporaryDirectory() as folder:
        return _campaign(seed, bench, armed, Path(folder))


def _campaign(seed: int, bench: BenchFile, armed: tuple[Armed, ...], folder: Path) -> End:
    clock = LimitedClock()
    simulation: Simulation = open_simulation(bench, clock)
    database = Database(new_database(folder), write=True)
    store = Store(database)
    hung = False
    opened = open_bench(bench, clock, simulation)
    prepared = preparation.prepare(store, RECIPE, bench, clock, clip=False, opened=opened)
    journal = CountingJournal(database, prepared.id)
    store.campaigns.journal = lambda _: journal  # type: ignore[method-assign]  # what a study looks through
    for each in armed:
        simulation.faults(each.url).arm(each.kind, **each.settings)
    try:
        execution.run(store, prepared)
    except Hung:
        hung = True
    row = store.campaigns.get(prepared.id)
    now_s = clock.now_s()
    for each in armed:
        simulation.faults(each.url).clear()
    looked = open_bench(bench, clock, simulation)
    at_safe_c = abs(looked.chamber.read().setpoint_c - bench.chamber.safe_c) < 0.11
    looked.close()
    safe = at_safe_c and not simulation.world.table.moving(now_s)
    end = End(
        seed, armed, row.state, row.reason, hung, journal.handed_over - len(all_readings(database)), safe,
        bool(store.benches.unconfirmed(bench.name)),
    )  # fmt: skip
    store.close()
    return end


def run_faults(seeds: range) -> dict[str, float]:
    """Run campaigns with faults, and return the figures; those that are not as promised are printed."""
    with ProcessPoolExecutor(max_workers=2) as pool:
        ends = list(pool.map(one, seeds, chunksize=4))
    for end in ends:
        if not end.well:
            print(f"   not as promised: {end}", flush=True)
    states = Counter(end.state for end in ends)
    kinds = {(each.device, each.kind) for end in ends for each in end.armed}
    return {
        "campaigns": float(len(ends)),
        "faults": float(sum(len(end.armed) for end in ends)),
        "kinds_of_fault": float(len({kind for _, kind in kinds})),
        "done": float(states["done"]),
        "failed_and_said_why": float(sum(end.state == "failed" and end.well for end in ends)),
        "hung": float(sum(end.hung for end in ends)),
        "readings_lost": float(sum(end.lost_readings for end in ends)),
        "not_confirmed_safe_and_said": float(sum(end.said for end in ends)),
        "unsafe_and_silent": float(sum(not (end.safe or end.said) for end in ends)),
        "as_promised": float(sum(end.well for end in ends)),
    }


def run() -> dict[str, float]:
    """Return the figures of the whole study."""
    return run_faults(range(CAMPAIGNS))
