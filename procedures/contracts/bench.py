"""What a procedure needs of a bench: its opened instruments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.reference import Reference
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable


class Bench(Protocol):
    """The instruments of one bench, opened. A bench on which units are turned by hand may have no table, no chamber."""

    @property
    def table(self) -> RateTable | None: ...

    @property
    def chamber(self) -> Chamber | None: ...

    @property
    def gyros(self) -> Mapping[str, Gyro]: ...

    @property
    def references(self) -> Mapping[str, Reference]: ...

    @property
    def supply(self) -> Supply | None: ...

    @property
    def configurations(self) -> Mapping[str, Mapping[str, str]]: ...  # unit -> how it is to be set


class MonitoredBench(Protocol):
    """What is watched of a bench: the chamber, where it has one, references, and the units that take part."""

    @property
    def air_chamber(self) -> Chamber | None: ...

    @property
    def gyros(self) -> Mapping[str, Gyro]: ...

    @property
    def references(self) -> Mapping[str, Reference]: ...
