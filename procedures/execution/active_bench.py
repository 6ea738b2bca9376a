"""The instruments of a bench with those units that still take part."""

from __future__ import annotations

from dataclasses import dataclass, field

from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable
from procedures.contracts.bench import Bench


@dataclass
class ActiveBench:
    """A bench whose units can drop out."""

    table: RateTable
    chamber: Chamber
    gyros: dict[str, Gyro]  #: by name; those that take part
    dropped: dict[str, str] = field(default_factory=dict)  #: unit name -> why it dropped out

    @classmethod
    def of(cls, bench: Bench) -> ActiveBench:
        """Return an opened bench with all of its units taking part."""
        return cls(bench.table, bench.chamber, dict(bench.gyros))

    def drop(self, gyro: str, reason: str) -> Gyro:
        """Let a unit take no further part; returns it."""
        self.dropped[gyro] = reason
        return self.gyros.pop(gyro)
