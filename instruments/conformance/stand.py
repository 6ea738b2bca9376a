"""A driver on a simulated bench, in virtual time, with the faults of its instrument at hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, is_simulated_address, read_bench, shipped_benches
from instruments.clock import VirtualClock
from instruments.drivers.driver import ChamberDriver, GyroDriver, ReferenceDriver, SupplyDriver, TableDriver, Trial
from instruments.drivers.registry import DRIVERS
from instruments.drivers.resolution import resolve

if TYPE_CHECKING:
    from instruments.simulators.links.faults import Faults

Kind = Literal["table", "chamber", "reference", "supply", "gyro"]
KINDS: dict[type, Kind] = {
    TableDriver: "table", ChamberDriver: "chamber", ReferenceDriver: "reference", SupplyDriver: "supply",
    GyroDriver: "gyro",
}  # fmt: skip


@dataclass
class Stand:
    """A driver, opened, and what is around it."""

    kind: Kind
    file: BenchFile
    clock: VirtualClock
    bench: Bench
    driver: Any
    url: str  #: of the driver's instrument

    @property
    def faults(self) -> Faults:
        """Faults that can be armed in the driver's instrument."""
        assert self.bench.simulation is not None
        return self.bench.simulation.faults(self.url)

    def ask(self) -> object:
        """Ask the instrument something that needs an answer; raises InstrumentError."""
        if self.kind == "gyro":
            self.driver.start()
            return self.driver.read_latest()
        return self.driver.identify()

    def close(self) -> None:
        """Close the driver's link, without stopping anything."""
        self.driver.stop() if self.kind == "gyro" else self.driver.close()


def kind_of(name: str) -> Kind:
    """Return the kind of a driver; raises PluginError for one that is not installed or cannot be loaded."""
    return KINDS[type(DRIVERS.get(name))]


def place_of(name: str) -> BenchFile:
    """Return the simulated bench on which a driver is tried: that of its own trial, else a shipped bench that uses it.

    Raises PluginError for a driver that is not installed, ValueError where no simulated bench has it.
    """
    kind, trial = kind_of(name), DRIVERS.get(name).trial
    if trial is not None:
        return _with_trial(name, kind, trial)
    for path in shipped_benches().values():
        bench = read_bench(path)
        if bench.is_simulated and name in [section.driver for section in bench.sections.values()]:
            return resolve(bench)
    raise ValueError(
        f"driver {name!r} has no simulated bench to be checked on; give the driver a Trial "
        "(instruments.drivers.driver) with the address of its simulator, or name a bench file that uses the "
        "driver with --bench"
    )


def _with_trial(name: str, kind: Kind, trial: Trial) -> BenchFile:
    record = read_bench(trial.bench).model_dump()
    section: dict[str, object] = {"driver": name, **trial.section}
    if kind == "gyro":
        gyro = record["gyros"][0]
        general_keys = ("name", "serial", "axes", "max_rate_dps", "min_c", "max_c", "technology")
        record["gyros"] = [{key: gyro[key] for key in general_keys} | section]
        if trial.unit:
            record["simulation"]["units"] |= {record["gyros"][0]["name"]: dict(trial.unit)}
    elif kind == "reference":
        record["references"] = [{"name": "reference"} | section]
    else:
        record[kind] = (record[kind] or {}) | section
        record["simulation"]["table"] |= dict(trial.table)
    try:
        return resolve(BenchFile.model_validate(record))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ValueError(
            f"driver {name!r}: its Trial does not describe a valid bench: {place}: {first['msg']}; correct the Trial"
        ) from error


def open_stand(name: str, file: BenchFile) -> Stand:
    """Return a driver on a bench; no byte is sent.

    Raises ValueError for a bench that does not have the driver, or has it on a real address, and what open_bench does.
    """
    kind = kind_of(name)
    entry = next(((key, section) for key, section in file.sections.items() if section.driver == name), None)
    if entry is None:
        raise ValueError(f"bench {file.name!r} has no {kind} with driver {name!r}; name a bench that has one")
    url = entry[1].port or entry[1].host or ""
    if not is_simulated_address(url):
        raise ValueError(
            f"driver {name!r} is at {url or 'no address'} on bench {file.name!r}, but a driver is checked on a "
            "simulated instrument only; give it an address that begins with sim://"
        )
    clock = VirtualClock()
    bench = open_bench(file, clock)
    drivers: dict[str, Any] = {"table": bench.table, "chamber": bench.chamber, "supply": bench.supply}
    drivers |= {**bench.references, **bench.gyros}
    return Stand(kind, file, clock, bench, drivers[entry[0]], url)
