"""The instruments of a bench with those units that still take part."""

from __future__ import annotations

from dataclasses import dataclass, field

from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable
from procedures.contracts.bench import Bench


@dataclass
class ActiveBench:
    """A bench whose units can drop out. `dropped` says which did, and why."""

    table: RateTable
    chamber: Chamber
    gyros: dict[str, Gyro]
    dropped: dict[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, bench: Bench, dropped: dict[str, str] | None = None) -> ActiveBench:
        """Return the crew of an opened bench, without the units that dropped out before."""
        gone = dict(dropped or {})
        taking_part = {name: gyro for name, gyro in bench.gyros.items() if name not in gone}
        return cls(bench.table, bench.chamber, taking_part, gone)

    def drop(self, gyro: str, reason: str) -> Gyro:
        """Let a unit take no further part; returns it."""
        self.dropped[gyro] = reason
        return self.gyros.pop(gyro)
