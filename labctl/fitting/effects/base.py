"""One physical effect: its name and explanation, and the regressors that it adds to the error of a gyro.

An effect is written as one small frozen class; it is added to the catalogue by listing it in its family's module.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from labctl.answers.effect_origin import Origin
from labctl.fitting.data.channels import Carrier, Channels
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.effects.equation import Equation, Source
from labctl.fitting.numeric.arrays import Array

#: Which output axes an effect shows on: the one that turns, the others, or all alike.
Rows = Literal["own", "cross", "all"]
#: How many values of a nonlinear parameter compete.
GRID_POINTS = 6


@dataclass(frozen=True)
class Parameter:
    """A parameter that enters nonlinearly, with the range in which it makes sense."""

    name: str
    unit: str
    low: float
    high: float
    logarithmic: bool = False
    symbol: str = ""  #: in the equation of its effect; "": a switch, which chooses a case there
    meaning: str = ""
    optional: bool = False  #: whether a term may leave it out
    refined: bool = False  #: whether it only begins the fit, which finds it as a coefficient

    def grid(self, points: int) -> Array:
        """Return `points` values across the range."""
        if self.logarithmic:
            return np.geomspace(self.low, self.high, points)
        return np.linspace(self.low, self.high, points)


@dataclass(frozen=True)
class Law:
    """An error that is not proportional to its coefficient: both functions map coefficients (n,) to (n,)."""

    error_dps: Callable[[Array], Array]
    slope: Callable[[Array], Array]  #: derivative of the error along the coefficient


@dataclass(frozen=True)
class Column:
    """One regressor: what its coefficient is called, the coefficient's unit, and the values (n,).

    values x coefficient is an error in deg/s of the output, gyro minus true rate. With a `carrier`, a wave and how
    often it comes per turn of the table, the values are its size: it goes round far faster than they change. With a
    `law` the error is that law of the coefficient; the values are then its shape, whose product is right at `start`.
    """

    name: str
    unit: str
    values: Array
    carrier: Carrier | None = None
    law: Law | None = None
    start: float = 0.0

    def error_dps(self, coefficient: Array) -> Array:
        """Return the error in deg/s, (n,), of coefficients (n,)."""
        return self.values * coefficient if self.law is None else self.law.error_dps(coefficient)

    def slope(self, coefficient: Array) -> Array:
        """Return the derivative of the error along the coefficient, (n,), at coefficients (n,)."""
        return self.values if self.law is None else self.law.slope(coefficient)

    def mean(self, channels: Channels) -> Array:
        """Return the regressor as each row of the channels sees it on average, (n,)."""
        return self.values if self.carrier is None else self.values * channels.harmonic(self.carrier)

    def averaged(self, channels: Channels) -> Column:
        """Return this regressor without its carrier, as each row of the channels sees it on average."""
        return self if self.carrier is None else replace(self, values=self.mean(channels), carrier=None)


@dataclass(frozen=True)
class Span:
    """What a recording covers: from where the options of an effect are drawn."""

    rate_dps: float  #: the greatest
    slowest_dps: float  #: the least that is not rest
    rates_dps: tuple[float, ...]  #: all, without sign, rising
    channels: frozenset[str]

    def has(self, channel: str) -> bool:
        """Whether a channel is logged."""
        return channel in self.channels

    def between_rates(self, low: float, high: float) -> Array:
        """Return the midpoints of neighbouring rates that lie between `low` and `high`, shares of the greatest rate."""
        rates = np.array(self.rates_dps)
        middles = (rates[:-1] + rates[1:]) / 2
        return middles[(middles >= low * self.rate_dps) & (middles <= high * self.rate_dps)]


@dataclass(frozen=True)
class Term:
    """An effect as it stands in a model: with its polynomial order and the values of its nonlinear parameters."""

    effect: str
    order: int | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    formula: str = ""  #: what a person wrote, where the effect is not of the catalogue
    steady: bool = False  #: one coefficient for all temperatures, also in a model that has a table over them


@dataclass(frozen=True)
class Reference:
    """What the columns are centred on, kept with the coefficients."""

    temperature_c: float = 25.0


class Effect(ABC):
    """One physical cause of a gyro's error."""

    id: str
    term: ClassVar[str]  #: the standard's word (IEEE Std 528 / 952)
    sentence: str  #: one sentence that explains it to a reader
    origin: ClassVar[Origin]
    rows: ClassVar[Rows] = "own"
    needs: tuple[str, ...] = ()  #: channels beyond rate and temperature
    by_temperature: bool = False  #: whether it cannot be seen without a thermometer
    default_order: ClassVar[int | None] = None  #: of a polynomial; None where there is no order to choose
    min_order: ClassVar[int] = 1
    max_order: ClassVar[int | None] = None
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {}  #: technology -> plausible size of the first coefficient
    one_sign: ClassVar[bool] = False  #: whether the first coefficient has the sign of its range; else of either sign
    aliases: ClassVar[tuple[str, ...]] = ()  #: ids of the same columns, in one of the shapes, whatever the schedule
    alike_at_one_radius: ClassVar[bool] = False  #: whether it is its aliases at one distance from the table's axis only
    experiment: ClassVar[str] = ""  #: what would distinguish it from similar effects
    equation: ClassVar[Equation | None] = None
    sources: ClassVar[tuple[Source, ...]] = ()  #: of the equation, or of the definition of the effect
    draws: tuple[str, ...] = ()  #: views of a criticism, or channels, whose picture it would draw
    shows_at_rest: bool = False  #: whether it is an error of the bias, at least in part: then it takes no rate to see
    remembers: ClassVar[bool] = False  #: whether it needs the temperatures before, which a state stands for in use
    exact: ClassVar[bool] = False  #: whether its parameters determine its shape: a fit alone distinguishes two such
    bends_at_high_rates: ClassVar[bool] = False  #: whether it is a law of the rate alone that grows towards the limit
    is_random: ClassVar[bool] = False  #: each powered run or mounting has a coefficient of its own, a draw
    in_use: ClassVar[bool] = True  #: whether what it needs is known where the gyro is used, and not on the bench only

    @abstractmethod
    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the regressors of this effect for one output axis; none where it does not touch the axis."""

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels beyond the rate that it cannot be seen without, the thermometer among them."""
        return (*self.needs, "temperature_c") if self.by_temperature else self.needs

    def shaped_by(self, term: Term, coefficients: Mapping[str, float]) -> Term:
        """Return a term whose columns have the shape of a fit: axis -> its first coefficient, at the nodes' mean."""
        return term

    def states_shape(self, term: Term) -> bool:
        """Return whether a term has a value of a quantity that its shape is found by (a time constant, a width)."""
        return any(p.name in term.parameters for p in self.parameters if p.logarithmic)

    def kept(self, term: Term, history: TemperatureHistory) -> Term:
        """Return a term with what its columns take from a recording and a calibration file has to keep."""
        return term

    @classmethod
    def outside(cls, technology: str, value: float, u: float) -> bool | None:
        """Return whether a first coefficient is outside its plausible range by two standard uncertainties `u`.

        None where no range is known for a technology. A range is one of sizes, unless the effect has `one_sign`.
        """
        if (span := cls.ranges.get(technology)) is None:
            return None
        spare = 2.0 * u if np.isfinite(u) else 0.0  # a fit without degrees of freedom has no uncertainty
        if cls.one_sign:
            return value + spare < span[0] or value - spare > span[1]
        return abs(value) - spare > max(abs(span[0]), abs(span[1]))

    def least(self, term: Term) -> tuple[int, int]:
        """Return how many different (rates, temperatures) this effect's coefficients need to be determined."""
        return (1 if self.shows_at_rest else 2), 1

    def undetermined_by(self, channels: Channels, axis: str) -> str:
        """Return why rows cannot determine this effect on an output axis, whatever they are; "" where they can.

        For an effect whose cause has to change by more than it does unintended: a drift of the cause is no experiment.
        """
        return ""

    def aliases_in(self, channels: Channels) -> tuple[str, ...]:
        """Return the ids of effects that no further data sets beside rows of these channels tell from this one.

        Where the distance from the table's axis is known, data sets at another one do.
        """
        return () if self.alike_at_one_radius and np.any(np.isfinite(channels.radius_m())) else self.aliases

    def options(self, span: Span) -> list[Term]:
        """Return the shapes in which this effect competes for a recording: orders, and a grid of its parameters."""
        if self.max_order is not None:
            return [Term(self.id, order) for order in range(self.min_order, self.max_order + 1)]
        grids = {p.name: p.grid(GRID_POINTS) for p in self.parameters}
        return by_parameter(self.id, **grids)

    def order(self, term: Term) -> int:
        """Return the polynomial order that a term asks for, or this effect's own."""
        return term.order if term.order is not None else (self.default_order or 1)


def by_parameter(effect_id: str, **grids: Array) -> list[Term]:
    """Return a term for every combination of parameter values."""
    return [
        Term(effect_id, None, dict(zip(grids, map(float, values), strict=True)))
        for values in itertools.product(*grids.values())
    ]


def powers(values: Array, exponents: range) -> dict[int, Array]:
    """Return values**k for each k of a rising range of whole exponents >= 1, by repeated multiplication."""
    by_power: dict[int, Array] = {}
    power = np.ones_like(values)
    for exponent in range(1, exponents.stop):
        power = power * values
        if exponent in exponents:
            by_power[exponent] = power
    return by_power
