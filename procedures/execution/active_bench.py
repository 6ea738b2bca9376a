"""The instruments of a bench with those units that still take part."""

from __future__ import annotations

from dataclasses import dataclass, field

from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.reference import Reference
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable
from procedures.contracts.bench import Bench
from procedures.contracts.errors import StepFailed


@dataclass
class ActiveBench:
    """A bench whose units can drop out."""

    rate_table: RateTable | None
    air_chamber: Chamber | None
    gyros: dict[str, Gyro]  #: by name; those that take part
    dropped: dict[str, str] = field(default_factory=dict)  #: unit name -> why it dropped out
    references: dict[str, Reference] = field(default_factory=dict)  #: by name; the supply among them
    supply: Supply | None = None  #: of the units

    @classmethod
    def of(cls, bench: Bench) -> ActiveBench:
        """Return an opened bench with all of its units taking part."""
        references: dict[str, Reference] = dict(bench.references)
        if bench.supply is not None:  # its voltage is logged beside the readings
            references[bench.supply.name] = bench.supply
        return cls(bench.table, bench.chamber, dict(bench.gyros), references=references, supply=bench.supply)

    @property
    def table(self) -> RateTable:
        """The rate table, for steps that need one. Raises StepFailed."""
        if self.rate_table is None:
            raise StepFailed(
                "this bench has no rate table; name a bench that has one, or choose a recipe with "
                "[turns] (turns by hand)"
            )
        return self.rate_table

    @property
    def chamber(self) -> Chamber:
        """The chamber, for steps that need one. Raises StepFailed."""
        if self.air_chamber is None:
            raise StepFailed(
                "this bench has no chamber; name a bench that has one, or choose a recipe with [turns] (turns by hand)"
            )
        return self.air_chamber

    @property
    def table_name(self) -> str:
        """Name of the rate table in messages; empty without one."""
        return "" if self.rate_table is None else self.rate_table.name

    @property
    def chamber_name(self) -> str:
        """Name of the chamber in messages; empty without one."""
        return "" if self.air_chamber is None else self.air_chamber.name

    def stop_table(self) -> None:
        """Stop the rate table, if there is one. Raises InstrumentError."""
        if self.rate_table is not None:
            self.rate_table.stop()

    def power_units(self) -> None:
        """Switch the supply on at its nominal voltage, if there is one. Raises InstrumentError."""
        if self.supply is not None:
            self.supply.set_voltage_v(self.supply.limits.nominal_v)

    def drop(self, gyro: str, reason: str) -> Gyro:
        """Exclude a unit from the rest of the campaign; returns it."""
        self.dropped[gyro] = reason
        return self.gyros.pop(gyro)
