"""What a procedure needs of a bench: its opened instruments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable


class Bench(Protocol):
    """The instruments of one bench, opened."""

    @property
    def table(self) -> RateTable: ...

    @property
    def chamber(self) -> Chamber: ...

    @property
    def gyros(self) -> Mapping[str, Gyro]: ...
