"""A process that can be killed at any instant: its clock, its wires and its database all end at once."""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sa

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from instruments.simulation import Simulation, open_simulation
from instruments.simulators.links.device import SimulatedDevice
from labctl.store.connection.database import Database
from labctl.store.connection.location import is_url
from labctl.store.repositories.sample_blocks import blocks_of
from labctl.store.schema import tables
from studies import databases


class Killed(BaseException):
    """The process is gone. Nothing in labctl may catch this."""


@dataclass
class Life:
    """Counts the instants of a process and ends it at one of them; from then on nothing works any more."""

    ends_at: int | None = None
    ticks: int = 0
    dead: bool = False

    def tick(self) -> None:
        """Pass one instant. Raises Killed."""
        if not self.dead:
            self.ticks += 1
            self.dead = self.ends_at is not None and self.ticks >= self.ends_at
        if self.dead:
            raise Killed


class MortalClock(VirtualClock):
    """Virtual time that ends with its process. It goes on for the next one, as the world's time does."""

    def __init__(self, life: Life) -> None:
        super().__init__()
        self.life = life

    def sleep(self, duration_s: float) -> None:
        self.life.tick()
        super().sleep(duration_s)


class MortalWire:
    """A wire that a dead process can no longer use; the instrument at its end lives on."""

    def __init__(self, device: SimulatedDevice, clock: MortalClock) -> None:
        self._device, self._clock = device, clock

    def _alive(self) -> SimulatedDevice:
        if self._clock.life.dead:
            raise Killed
        return self._device

    def receive(self, data: bytes, t_s: float) -> None:
        """Pass bytes on."""
        self._alive().receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        """Return what the instrument sends."""
        return self._alive().transmit(t_s)

    def skip(self, t_s: float) -> None:
        """Lose what was sent."""
        self._alive().skip(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        """Return when the next byte comes."""
        return self._alive().next_byte_s(t_s)


class MortalDatabase(Database):
    """A database whose process can end before, inside and after a commit; remembers what a power cut would leave."""

    def __init__(self, location: str, life: Life) -> None:
        self.life = Life()
        super().__init__(location, write=True)
        self.life = life
        self.synced_bytes = 0
        if is_url(location):
            return
        with self._engine.connect() as connection:  # the log only grows, so that its length says what is on the disk
            connection.exec_driver_sql("PRAGMA wal_autocheckpoint=0")

    @property
    def log(self) -> Path:
        """The write-ahead log."""
        return Path(f"{self.location}-wal")

    @contextmanager
    def writing(self, *, synced: bool = True) -> Iterator[sa.Connection]:
        """Give the writing connection, with an instant before, inside and after the commit."""
        self.life.tick()
        with super().writing(synced=synced) as connection:
            yield connection
            self.life.tick()
        if synced and self.log.exists():
            self.synced_bytes = self.log.stat().st_size
        self.life.tick()

    def abandoned_campaigns(self, folder: Path, *, power_cut: bool, rng: np.random.Generator) -> str:
        """Copy what the next process finds: everything committed, or after a power cut what was on the disk at least.

        Between the last sync and the end of the log a power cut may leave any byte as the last one.
        """
        if is_url(self.location):
            self._engine.dispose()
            if power_cut:
                databases.server().crash()
            return self.location
        folder.mkdir(parents=True)
        copy = folder / "lab.sqlite"
        shutil.copy(self.location, copy)
        if self.log.exists():
            data = self.log.read_bytes()
            if power_cut:
                data = data[: int(rng.integers(self.synced_bytes, len(data) + 1))]
            (folder / "lab.sqlite-wal").write_bytes(data)
        return str(copy)


def all_readings(database: Database) -> set[tuple[int, int, int]]:
    """Return every reading, of complete and of partial data sets, as (recording, data set, time in ns)."""
    b, found = tables.sample_blocks.c, set()
    with database.reading() as connection:
        for recording, number in connection.execute(sa.select(b.recording_id, b.number).distinct()).all():
            for part in blocks_of(connection, recording, number):
                found |= {(recording, number, int(t_ns)) for t_ns in part["t_ns"]}
    return found


def complete_data_sets(database: Database) -> Counter[int]:
    """Return how often each data set of the plan is there as a complete one."""
    d = tables.data_sets.c
    with database.reading() as connection:
        return Counter(connection.scalars(sa.select(d.planned).where(d.state == "complete")))


class World:
    """The bench that outlives every process: one simulation in one time, and the commands it received."""

    def __init__(self, bench: BenchFile) -> None:
        self.bench_file = bench
        self.clock = MortalClock(Life())
        self.simulation: Simulation = open_simulation(bench, self.clock)
        self.setpoints_c: list[float] = []
        self.rates_dps: list[float] = []
        self._devices: dict[str, MortalWire] = {}
        self._listen()

    def _listen(self) -> None:
        world, table = self.simulation.world, self.simulation.world.table
        set_air, start = world.heat.set, table.start

        def set_listened(t_s: float, temperature_c: float) -> None:
            self.setpoints_c.append(temperature_c)
            set_air(t_s, temperature_c)

        def start_listened(t_s: float, steps: int, step_rate_hz: float, acceleration_dps2: float) -> float:
            self.rates_dps.append(step_rate_hz * table.step_deg)
            return float(start(t_s, steps, step_rate_hz, acceleration_dps2))

        world.heat.set, table.start = set_listened, start_listened

    @property
    def world(self) -> Any:
        """The simulated world, in which the unit handler turns and switches the units."""
        return self.simulation.world

    def device(self, url: str) -> SimulatedDevice:
        """Return the instrument at an address."""
        return self._devices.setdefault(url, MortalWire(self.simulation.device(url), self.clock))

    def faults(self, url: str) -> Any:
        """Return what can be armed in the instrument at an address."""
        return self.simulation.faults(url)

    def open(self) -> Bench:
        """Open the bench anew, as a new process does."""
        return open_bench(self.bench_file, self.clock, self)

    def pass_gap(self, gap_s: float, *, power_cut: bool) -> None:
        """Let time pass with no process there; a power cut stops the table and switches the units off."""
        self.clock.life = Life()
        if power_cut:
            self.world.table.abort(self.clock.now_s())
            self.world.power(self.clock.now_s(), False)
        self.clock.sleep(gap_s)

    @property
    def within_limits(self) -> bool:
        """Whether table and chamber were never commanded beyond their limits."""
        table, chamber = self.bench_file.table, self.bench_file.chamber
        fast = all(rate <= table.max_rate_dps * (1 + 1e-6) for rate in self.rates_dps)
        return fast and all(chamber.min_c <= set_c <= chamber.max_c for set_c in self.setpoints_c)
