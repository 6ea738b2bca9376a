"""What a bench and its units can do, and which points of a recipe lie beyond it. Pure: no device is opened."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from instruments.eccentricity import Eccentricity
from instruments.errors import InstrumentError
from instruments.interfaces.chamber import ChamberLimits
from instruments.interfaces.gyro import GyroLimits
from instruments.interfaces.rate_course import RateCourse, course_complaint
from instruments.interfaces.supply import SupplyLimits
from instruments.interfaces.table import TableLimits
from instruments.positions import Position
from procedures.contracts.bench import Bench
from procedures.contracts.errors import PlanRefused
from procedures.planning.earlier_times import EarlierTimes
from procedures.recipe.recipe import Recipe

NEEDS = "Name a bench with both, or choose a recipe with [turns], such as by-hand, which needs neither."
CONSTANT_ONLY = (
    "the driver of the table runs constant rates only; name a bench with a table that follows a course (driver "
    "acutrol-3000), use `labctl simulate`, or remove [[profiles]]"
)
ADVICE = "Change the recipe, or plan with --clip to leave these points out."


@dataclass(frozen=True)
class BenchLimits:
    """Limits of the table, the chamber and every unit."""

    table: TableLimits | None  #: None: the bench has none; `chamber` likewise
    chamber: ChamberLimits | None
    gyros: Mapping[str, GyroLimits]
    achievable_dps: Callable[[float], float] | None = (
        None  #: nearest rate that the table can run (step quantisation), deg/s
    )
    needs_person: bool = True  #: whether a person turns the units; a unit handler takes no time that a plan counts
    #: whether the table moves in a campaign; in a simulation without bytes any table follows any course of the rate
    is_driven: bool = True
    air_tau_s: float | None = None  #: time constant of the chamber's air, for the forecast; None: a guess is used
    earlier: EarlierTimes | None = None  #: what earlier campaigns of the bench took, for the forecast
    tilted_positions: tuple[str, ...] = ()  #: directions of the body that a tilted fixture brings up
    supply: SupplyLimits | None = None  #: of the units; None: labctl does not set it
    eccentricity: Eccentricity | None = None  #: the units' distances from the table's axis; None: not known

    @classmethod
    def of(
        cls, bench: Bench, *, needs_person: bool = True, air_tau_s: float | None = None,
        earlier: EarlierTimes | None = None, tilted_positions: tuple[str, ...] = (),
        eccentricity: Eccentricity | None = None,
    ) -> BenchLimits:  # fmt: skip
        """Return the limits of an opened bench, the others as its file says (`BenchFile`)."""
        units = {name: gyro.limits for name, gyro in bench.gyros.items()}
        chamber = None if bench.chamber is None else bench.chamber.limits
        table = (None, None) if bench.table is None else (bench.table.limits, bench.table.achievable_dps)
        supply = None if bench.supply is None else bench.supply.limits
        return cls(
            table[0], chamber, units, table[1], needs_person, True, air_tau_s, earlier, tilted_positions, supply,
            eccentricity,
        )  # fmt: skip

    @property
    def max_acceleration_dps2(self) -> float:
        """Largest acceleration of the table, deg/s^2; infinite without one."""
        return math.inf if self.table is None else self.table.max_acceleration_dps2

    @property
    def ramp_c_per_min(self) -> float:
        """Fastest ramp of the chamber's air; infinite without one."""
        return math.inf if self.chamber is None else self.chamber.ramp_c_per_min

    def rate_complaint(self, rate_dps: float, max_error_fraction: float) -> str | None:
        """Return which limit of the table or a unit a rate exceeds, or None."""
        complaints = [
            f"the {limit:g} deg/s of {owner}"
            for owner, limit in [*self._table_rate(), *_unit_rates(self.gyros)]
            if abs(rate_dps) > limit
        ]
        if complaints:
            return "beyond " + " and ".join(complaints)
        return self._quantisation_complaint(rate_dps, max_error_fraction)

    def course_complaint(self, course: RateCourse) -> str | None:
        """Return which limit of the table or a unit a course of the rate exceeds, or None."""
        table = self.table
        if table is None or not self.is_driven:
            return None
        if not table.follows_courses:
            return CONSTANT_ONLY
        if text := course_complaint(course, table.max_rate_dps, table.max_acceleration_dps2):
            return text
        beyond = [
            f"the {limit:g} deg/s of {owner}" for owner, limit in _unit_rates(self.gyros) if course.largest_dps > limit
        ]
        return (
            f"reaches {course.largest_dps:g} deg/s, beyond {' and '.join(beyond)}; make it slower" if beyond else None
        )

    def _table_rate(self) -> list[tuple[str, float]]:
        return [] if self.table is None else [("the table", self.table.max_rate_dps)]

    def _quantisation_complaint(self, rate_dps: float, max_error_fraction: float) -> str | None:
        if self.achievable_dps is None or rate_dps == 0:
            return None
        try:
            real_dps = self.achievable_dps(rate_dps)
        except InstrumentError as error:
            return str(error)
        if abs(real_dps - rate_dps) <= max_error_fraction * abs(rate_dps):
            return None
        return (
            f"the nearest rate that the table can run is {real_dps:g} deg/s, more than "
            f"{100 * max_error_fraction:g} % off"
        )

    def temperature_complaint(self, temperature_c: float) -> str | None:
        """Return which limit of the chamber or a unit a temperature exceeds, or None."""
        ranges = [] if self.chamber is None else [("the chamber", self.chamber.min_c, self.chamber.max_c)]
        ranges += [(f"unit {name}", unit.min_c, unit.max_c) for name, unit in self.gyros.items()]
        complaints = [
            f"the {low:g} to {high:g} deg C of {owner}"
            for owner, low, high in ranges
            if not low <= temperature_c <= high
        ]
        return "outside " + " and ".join(complaints) if complaints else None

    def supply_complaint(self, deviation_pct: float) -> str | None:
        """Return which limit of the supply a deviation from its nominal voltage passes, or None."""
        return None if self.supply is None else self.supply.complaint(self.supply.voltage_v(deviation_pct))

    def real_rate_dps(self, rate_dps: float) -> float:
        """Return the rate the table would really run, as far as it is known."""
        return rate_dps if self.achievable_dps is None or rate_dps == 0 else self.achievable_dps(rate_dps)


def _unit_rates(gyros: Mapping[str, GyroLimits]) -> list[tuple[str, float]]:
    return [(f"unit {name}", unit.max_rate_dps) for name, unit in gyros.items()]


def missing_instruments(recipe: Recipe, limits: BenchLimits) -> tuple[str, ...]:
    """Return which instruments a recipe needs and the bench does not have, each in words."""
    if recipe.turns is not None:
        return ()
    table = () if limits.table is not None else ("rates_dps: a rate table is needed, but the bench has none",)
    chamber = () if limits.chamber is not None else ("temperatures_c: a chamber is needed, but the bench has none",)
    return (*table, *chamber)


def fit_to_bench(recipe: Recipe, limits: BenchLimits, *, clip: bool) -> tuple[Recipe, tuple[str, ...]]:
    """Return the recipe as this bench can run it, and what was left out.

    Raises PlanRefused naming every point beyond a limit; with `clip` only when a needed list would become empty or the
    temperature at which units are handled is out of reach.
    """
    if missing := missing_instruments(recipe, limits):
        raise PlanRefused(recipe.name, missing, NEEDS)
    if recipe.turns is not None:
        return recipe, ()
    values = recipe.model_dump()
    beyond: list[str] = []
    empty: list[str] = []
    for table, key in _point_lists(recipe):
        holder = values[table] if table else values
        name = f"{table}.{key}" if table else key
        complaints = {value: _complaint(limits, recipe, key, value) for value in holder[key]}
        beyond += [f"{name} {value:g}: {text}" for value, text in complaints.items() if text]
        holder[key] = tuple(value for value in holder[key] if not complaints[value])
        if not holder[key]:
            empty.append(f"{name}: no value is left within the limits")
    courses = [limits.course_complaint(profile.course) for profile in recipe.profiles]
    beyond += _courses_beyond(recipe, courses)
    values["profiles"] = tuple(each for each, text in zip(values["profiles"], courses, strict=True) if not text)
    empty += _ramp_complaints(recipe, limits) + _fixture_complaints(recipe, limits)
    empty += _no_supply(recipe, limits)
    radius_m, complaints_of_radius = _at_another_radius(recipe, limits)
    empty += complaints_of_radius
    handling = recipe.mounting.handling_c
    if handling is not None and (text := limits.temperature_complaint(handling)):
        empty.append(f"mounting.handling_c {handling:g}: {text}")
    if empty:
        raise PlanRefused(recipe.name, [*beyond, *empty], "Change the recipe.")
    if beyond and not clip:
        raise PlanRefused(recipe.name, beyond, ADVICE)
    if radius_m is not None:
        values["another_radius"]["radius_m"] = radius_m
    return (Recipe.model_validate(values), tuple(beyond)) if beyond or radius_m is not None else (recipe, ())


def _ramp_complaints(recipe: Recipe, limits: BenchLimits) -> list[str]:
    """Return which limits a ramp of the temperature exceeds: it is run whole or not at all."""
    ramp = recipe.ramp
    if ramp is None:
        return []
    ends = [("from_c", ramp.from_c), ("to_c", ramp.to_c), *(("then_c", end_c) for end_c in ramp.then_c)]
    complaints = [
        f"ramp.{name} {end_c:g}: {text}" for name, end_c in ends if (text := limits.temperature_complaint(end_c))
    ]
    if ramp.c_per_min is not None and ramp.c_per_min > limits.ramp_c_per_min:
        complaints.append(
            f"ramp.c_per_min {ramp.c_per_min:g}: faster than the {limits.ramp_c_per_min:g} K/min of the chamber"
        )
    return complaints


def _fixture_complaints(recipe: Recipe, limits: BenchLimits) -> list[str]:
    """Return which tilted mountings no fixture of the bench brings up; one upside down is another direction."""
    mounted = [Position.of(each) for each in recipe.positions]
    mounted += [each.upside_down for each in mounted] if recipe.inverted is not None else []
    tilted = dict.fromkeys(each.end for each in mounted if each.is_tilted)
    return [
        f"positions {end}: the bench states no tilted fixture that brings this direction of a unit up; where it has "
        f'one, add tilted_positions = ["{end}"] at the beginning of the bench file'
        for end in tilted
        if end not in limits.tilted_positions
    ]


def _no_supply(recipe: Recipe, limits: BenchLimits) -> list[str]:
    """Return what is said to a recipe with steps of the supply voltage on a bench without a supply."""
    if recipe.supply is None or limits.supply is not None:
        return []
    text = (
        "supply: the bench has no programmable supply, so that labctl cannot set the voltage of the units; where it "
        "has one, add a [supply] section to the bench file"
    )
    return [text]


def _at_another_radius(recipe: Recipe, limits: BenchLimits) -> tuple[float | None, list[str]]:
    """Return the radius of [another_radius] that the bench has, m, and why it has none."""
    rules, on = recipe.another_radius, limits.eccentricity
    if rules is None:
        return None, []
    others_m = () if on is None else on.other_radii_m
    if on is None or not others_m:
        text = (
            "another_radius: the bench states no second distance of the units from the axis of the table; where the "
            "fixture can be moved, add [eccentricity] with radius_m and other_radii_m, in m, to the bench file"
        )
        return None, [text]
    if rules.radius_m is None or rules.radius_m in others_m:
        return on.furthest_m if rules.radius_m is None else rules.radius_m, []
    radii_text = ", ".join(f"{radius_m:g}" for radius_m in others_m)
    text = (
        f"another_radius.radius_m {rules.radius_m:g}: the bench file states other_radii_m = [{radii_text}] m; name "
        "one of these, or leave radius_m out"
    )
    return None, [text]


def _courses_beyond(recipe: Recipe, complaints: list[str | None]) -> list[str]:
    """Return what is wrong with the courses of a recipe; once where no course can be run at all."""
    if CONSTANT_ONLY in complaints:
        return [f"profiles: {CONSTANT_ONLY}"]
    named = zip(recipe.profiles, complaints, strict=True)
    return [f"profiles[{n}], a {each.course.text}: {text}" for n, (each, text) in enumerate(named) if text]


def _point_lists(recipe: Recipe) -> list[tuple[str, str]]:
    """Return where the recipe lists points, as (table, key)."""
    lists = [("", "temperatures_c"), ("", "rates_dps")]
    for name in ("indexing", "inverted", "another_radius"):
        if getattr(recipe, name) is not None:
            lists += [(name, "temperatures_c"), (name, "rates_dps")]
    lists += [(name, "rates_dps") for name in ("power_cycle", "ramp", "supply") if getattr(recipe, name) is not None]
    return [*lists, ("supply", "deviations_pct")] if recipe.supply is not None else lists


def _complaint(limits: BenchLimits, recipe: Recipe, key: str, value: float) -> str | None:
    if key == "temperatures_c":
        return limits.temperature_complaint(value)
    if key == "deviations_pct":
        return limits.supply_complaint(value)
    return limits.rate_complaint(value, recipe.guards.max_rate_error_fraction)
