"""Schemes of a calibration: families of recipes with a few numbers each, from which a design chooses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from procedures.recipe.fit_rules import FitRules
from procedures.recipe.recipe import Recipe

#: What a designed recipe does not take over from the one that it is like.
NOT_TAKEN: Mapping[str, object] = {
    "fit": None, "verification": None, "profiles": (), "indexing": None, "inverted": None, "another_radius": None,
    "power_cycle": None, "supply": None, "ramp": None, "replicates": {}, "repeats": 1, "temperature_order": "as_listed",
    "rate_order": "as_listed",
}  # fmt: skip
#: A soak without waiting ends when the unit's thermometer has been read for so long, s, whatever it shows, K.
NO_WINDOW_S, ANY_DRIFT_C = 10.0, 50.0
#: A set point of a chamber, and a rate, are written to so many decimals.
SET_POINT_DECIMALS, RATE_DIGITS = 1, 4


@dataclass(frozen=True)
class Span:
    """What a scheme has to cover."""

    rate_dps: float  #: largest rate, both ways
    low_c: float
    high_c: float


@dataclass(frozen=True)
class Soak:
    """How long a level is held before anything is measured, and what the unit's thermometer may still do then."""

    hold_s: float
    window_s: float
    max_drift_c: float

    def table(self, base: Recipe) -> dict[str, object]:
        """Return the table of a recipe, the rest as in another recipe."""
        timeout_s = max(base.soak.timeout_s, 2.0 * self.hold_s)
        return {
            **base.soak.model_dump(), "hold_s": self.hold_s, "drift_window_s": self.window_s,
            "max_drift_c": self.max_drift_c, "timeout_s": timeout_s,
        }  # fmt: skip


NO_SOAK = Soak(0.0, NO_WINDOW_S, ANY_DRIFT_C)


@dataclass(frozen=True)
class Levels:
    """Fixed temperatures, each soaked, with every rate at each."""

    temperatures: int
    soak: Soak
    rates: int
    duration_s: float
    order: Literal["up", "up_down"] = "up"

    def changes(self, base: Recipe, span: Span) -> dict[str, object]:
        """Return the keys of the recipe that differ from those of `base`."""
        return {
            "temperatures_c": spread_temperatures_c(span, self.temperatures), "temperature_order": self.order,
            "rates_dps": sorted_rates(spread_rates_dps(span, self.rates)), "rate_order": "random",
            "soak": self.soak.table(base), "acquire": _acquire(base, self.duration_s),
        }  # fmt: skip


@dataclass(frozen=True)
class Cycle:
    """The temperature goes through the whole range and back while data are taken, without a soak.

    It begins and ends where the units are mounted, so that each temperature is passed while warming and while cooling
    (Niu et al., Sensors 13(9), 2013, 12192). With a tilted fixture it does so in the tilted mounting alone: the others,
    at the temperature where units are mounted, determine scale factors and misalignments there, and the tilted one how
    the scale factors of all axes change with temperature.
    """

    rates: int
    duration_s: float
    dwell_s: float  #: data go on for so long at either end of the range
    first_dwell_s: float  #: and so much longer in the first mounting
    ramp_share: float = 1.0  #: of the chamber's fastest ramp
    cycles: int = 1
    tilted: str = ""  #: direction that the tilted fixture brings up; empty: each mounting has its cycle
    repeats: int = 1  #: of the rates at the temperature where units are mounted

    def changes(self, base: Recipe, span: Span, ramp_c_per_min: float) -> dict[str, object]:
        """Return the keys of the recipe that differ from those of `base`."""
        begin_c = handling_c(base, span)
        ends = [end for end in (span.low_c, span.high_c) if end != begin_c] * self.cycles + [begin_c]
        rates = alternating(spread_rates_dps(span, self.rates))
        ramp: dict[str, object] = {
            "from_c": begin_c, "to_c": ends[0], "then_c": ends[1:], "rates_dps": rates, "dwell_s": self.dwell_s,
        }  # fmt: skip
        if self.first_dwell_s:
            ramp["first_dwell_s"] = self.dwell_s + self.first_dwell_s
        if self.ramp_share < 1.0 and math.isfinite(ramp_c_per_min):
            ramp["c_per_min"] = round(self.ramp_share * ramp_c_per_min, 3)
        positions = list(base.positions)
        if self.tilted:
            positions.append(self.tilted)
            ramp["positions"] = [self.tilted]
        return {
            "temperatures_c": [begin_c], "rates_dps": rates, "ramp": ramp, "soak": NO_SOAK.table(base),
            "acquire": _acquire(base, self.duration_s), "order": "position-major", "positions": positions,
            "repeats": self.repeats,
        }  # fmt: skip


Scheme = Levels | Cycle


def scheme_text(scheme: Scheme) -> str:
    """Return what a scheme does."""
    if isinstance(scheme, Cycle):
        ends = f", {scheme.dwell_s / 60:g} min at either end" if scheme.dwell_s else ""
        if scheme.first_dwell_s:
            ends += f", in the first mounting {(scheme.dwell_s + scheme.first_dwell_s) / 60:g} min"
        slow = f" at {100 * scheme.ramp_share:.0f} % of the fastest ramp" if scheme.ramp_share < 1 else ""
        times = f"{scheme.cycles} cycles" if scheme.cycles > 1 else "one cycle"
        where = f"with {scheme.tilted} up alone" if scheme.tilted else "in each mounting"
        return (
            f"{times} of the temperature {where}{slow}, without a soak{ends}; {scheme.rates} rates of "
            f"{scheme.duration_s:g} s"
        )
    order = ", up and down" if scheme.order == "up_down" else ""
    return (
        f"{scheme.temperatures} temperatures{order}, soaks of {scheme.soak.hold_s / 60:g} min; {scheme.rates} rates of "
        f"{scheme.duration_s:g} s"
    )


def recipe_of(
    scheme: Scheme, base: Recipe, span: Span, *, name: str, fit: FitRules, ramp_c_per_min: float,
    further: Mapping[str, object] | None = None,
) -> Recipe:  # fmt: skip
    """Return the recipe of a scheme over a span; what a scheme says nothing of is as in `base`.

    `further` are sections of the recipe that are measured besides, whatever the scheme.
    """
    changes = scheme.changes(base, span, ramp_c_per_min) if isinstance(scheme, Cycle) else scheme.changes(base, span)
    head = {"name": name, "description": f"Designed: {scheme_text(scheme)}", "fit": fit.model_dump()}
    return Recipe.model_validate({**base.model_dump(), **NOT_TAKEN, **changes, **(further or {}), **head})


def handling_c(base: Recipe, span: Span) -> float:
    """Return where a cycle begins: where units are mounted, or the end or middle of the range that is nearest."""
    at = base.mounting.handling_c
    return span.low_c if at is None else min(max(at, span.low_c), span.high_c)


def spread_temperatures_c(span: Span, number: int) -> list[float]:
    """Return temperatures, rising, both ends among them, denser towards the ends: a Chebyshev polynomial's extrema.

    A polynomial through values there has the smallest error between them, and no extrapolation.
    """
    middle, half = (span.high_c + span.low_c) / 2, (span.high_c - span.low_c) / 2
    shares = [-math.cos(math.pi * k / (number - 1)) for k in range(number)] if number > 1 else [0.0]
    return [round(middle + half * share, SET_POINT_DECIMALS) + 0.0 for share in shares]


def spread_rates_dps(span: Span, number: int) -> list[float]:
    """Return rates by size, rest first, then pairs of both signs, denser towards the largest, as temperatures are."""
    pairs = number // 2
    shares = [math.sin(math.pi * k / (2 * pairs)) for k in range(1, pairs + 1)]
    sizes = [float(f"{span.rate_dps * share:.{RATE_DIGITS}g}") for share in shares]
    rest = [0.0] if number % 2 else []
    return [*rest, *(sign * size for size in sizes for sign in (1.0, -1.0))]


def sorted_rates(rates_dps: list[float]) -> list[float]:
    """Return rates in rising order."""
    return sorted(rates_dps)


def alternating(rates_dps: list[float]) -> list[float]:
    """Return rates with the largest first and the signs in turn: what drifts slowly is alike in neighbours."""
    return sorted(rates_dps, key=lambda rate: (-abs(rate), -rate))


def _acquire(base: Recipe, duration_s: float) -> dict[str, object]:
    rules = base.acquire
    return {**rules.model_dump(), "duration_s": duration_s, "max_duration_s": max(rules.max_duration_s, duration_s)}
