"""What one physical effect is: who it is in words, and which columns it adds to the error of a gyro.

An effect is written as one small frozen class; it is added to the catalogue by listing it in its family's module.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from labctl.fitting.channels import Array, Channels

Origin = Literal["sensor", "package", "fixture", "bench", "environment"]
#: Which output axes an effect shows on: the one that turns, the others, or all alike.
Rows = Literal["own", "cross", "all"]


@dataclass(frozen=True)
class Parameter:
    """A parameter that enters nonlinearly, with the range in which it makes sense."""

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool = False

    def grid(self, points: int) -> Array:
        """Return `points` values across the range."""
        if self.logarithmic:
            return np.geomspace(self.low, self.high, points)
        return np.linspace(self.low, self.high, points)


@dataclass(frozen=True)
class Column:
    """One regressor: what its coefficient is called, the coefficient's unit, and the values (n,).

    values x coefficient is an error in deg/s of the output, gyro minus true rate.
    """

    name: str
    unit: str
    values: Array


@dataclass(frozen=True)
class Term:
    """An effect as it stands in a model: with its polynomial order and the values of its nonlinear parameters."""

    effect: str
    order: int | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Reference:
    """What the columns are centred on, kept with the coefficients."""

    temperature_c: float = 25.0


class Effect(ABC):
    """One physical cause of a gyro's error."""

    id: ClassVar[str]
    term: ClassVar[str]  #: the standard's word (IEEE Std 528 / 952)
    sentence: ClassVar[str]  #: what it is, for a person
    origin: ClassVar[Origin]
    rows: ClassVar[Rows] = "own"
    needs: ClassVar[tuple[str, ...]] = ()  #: channels beyond rate and temperature
    default_order: ClassVar[int | None] = None  #: of a polynomial; None where there is no order to choose
    min_order: ClassVar[int] = 1
    max_order: ClassVar[int | None] = None
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {}  #: technology -> plausible size of the first coefficient
    aliases: ClassVar[tuple[str, ...]] = ()  #: ids whose columns are the same whatever the schedule
    experiment: ClassVar[str] = ""  #: what would tell it from its likes

    @abstractmethod
    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the regressors of this effect for one output axis; none where it does not touch the axis."""

    def least(self, term: Term) -> tuple[int, int]:
        """Return how many different (rates, temperatures) tell this effect's coefficients apart."""
        return 2, 1

    def order(self, term: Term) -> int:
        """Return the polynomial order that a term asks for, or this effect's own."""
        return term.order if term.order is not None else (self.default_order or 1)


def powers(values: Array, exponents: range) -> dict[int, Array]:
    """Return values**k for each k of a rising range of whole exponents >= 1, by repeated multiplication."""
    found: dict[int, Array] = {}
    power = np.ones_like(values)
    for exponent in range(1, exponents.stop):
        power = power * values
        if exponent in exponents:
            found[exponent] = power
    return found
