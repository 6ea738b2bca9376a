"""What is found of the units of a type: each coefficient, groups that differ, and units unlike the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CoefficientPopulation:
    """One coefficient over the units of a type."""

    name: str
    unit: str
    mean: float  #: of the units outside of the groups that differ
    u_mean: float  #: standard uncertainty of the mean
    expanded_u_mean: float  #: U of the mean, 95.45 %, by Student's t
    spread: float  #: standard deviation of the units' true values
    spread_low: float  #: 95 % interval of the spread, from
    spread_high: float  #: to
    predictive_spread: float  #: root mean square of the spreads that the data allow, for a unit to come
    median_u: float  #: the units' own standard uncertainty
    units: int  #: without outliers


@dataclass(frozen=True)
class GroupEffect:
    """A group of units that differs from the rest of its type."""

    factor: str  #: batch, bench, supplier, or date: a trend
    level: str  #: name of the group; "" of a trend
    coefficients: tuple[str, ...]  #: that it shifts; several: all by the same amount
    shift: float  #: in the unit of the coefficients; of a trend, per year
    u: float  #: standard uncertainty of the shift
    unit: str
    units: int  #: units in the group; of a trend, with a date
    t: float  #: the shift over its standard uncertainty as the test had it, Student's t
    p_value: float  #: that chance gives such a group anywhere in the type
    same_as: tuple[tuple[str, str], ...]  #: (factor, level) of groups that explain it as well
    is_of_bench: bool  #: an error of a bench that all units on it share: it does not belong to the units


@dataclass(frozen=True)
class GroupSpread:
    """How much the levels of a factor differ from each other, beside the effects that are named."""

    factor: str
    coefficient: str
    spread: float  #: standard deviation between levels, in the unit of the coefficient
    levels: int
    p_value: float  #: that levels without differences scatter as much


@dataclass(frozen=True)
class OutlierUnit:
    """A unit that is not like its type in one coefficient."""

    serial_number: str
    coefficient: str
    unit: str
    value: float
    expected: float  #: mean of its type and groups
    spread: float  #: of the type
    u: float  #: the unit's own standard uncertainty
    t: float  #: distance from what the other units expect, over its standard uncertainty: Student's t, with sign
    p_value: float  #: that chance gives such a unit anywhere in the type

    @property
    def spreads(self) -> float:
        """The distance from what is expected, in spreads of the type, with sign; infinite where there is none."""
        off = self.value - self.expected
        return off / self.spread if self.spread > 0 else float(np.copysign(np.inf, off))

    @property
    def reason(self) -> str:
        """Why it is an outlier, in one sentence: its distance in spreads where they exceed its own uncertainty."""
        side, own = "above" if self.value > self.expected else "below", f"{self.u:.2g} {self.unit}"
        spread = f"{self.spread:.2g} {self.unit}"
        if self.spread > self.u:
            distance, beside = f"{abs(self.spreads):.1f} spreads of the type ({spread})", ""
        else:
            distance, beside = f"{abs(self.t):.1f} standard uncertainties", f"the spread of the type is {spread}, "
        return (
            f"{self.coefficient} = {self.value:.4g} {self.unit} is {distance} {side} the expected "
            f"{self.expected:.4g} {self.unit}; {beside}the unit's own standard uncertainty is {own}"
        ).replace(" )", ")")
