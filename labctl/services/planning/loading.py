"""Recipes and benches by name, path or text, and the plan of one on the other; nothing is opened."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from instruments.bench import checked_settings
from instruments.bench_config import BenchFile, read_bench, shipped_benches
from instruments.drivers.resolution import resolve
from instruments.interfaces.chamber import ChamberLimits
from instruments.interfaces.gyro import GyroLimits
from instruments.interfaces.supply import SupplyLimits
from instruments.interfaces.table import TableLimits
from instruments.positions import Position
from instruments.toml_documents import read_toml_text, shown
from labctl.errors import BadBench
from labctl.services.planning.earlier_campaigns import times_on_bench
from labctl.services.planning.fit_rules import check_fit
from procedures.contracts.errors import PlanRefused
from procedures.planning.earlier_times import EarlierTimes
from procedures.planning.limits import BenchLimits, missing_instruments
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe, parse_recipe, read_recipe, shipped_recipes

if TYPE_CHECKING:
    from labctl.store import Store

#: Of a chamber's set point, until its controller has been asked.
USUAL_RESOLUTION_C = 0.1
#: A key of a bench file that is not known is shown up to here.
LONGEST_PLACE = 80

#: End of the name of a shipped bench that simulates the unit of a paper.
OF_A_PAPER = "-paper-sim"


#: What else may refuse a plan on a bench; it raises PlanRefused.
Check = Callable[[Plan, BenchFile], None]


def no_check(_plan: Plan, _bench: BenchFile) -> None:
    """Refuse nothing."""


def load_recipe(source: str) -> Recipe:
    """Return a recipe by shipped name, by path, or from its own TOML text. Raises RecipeError."""
    if "\n" in source:
        return parse_recipe(source)
    return read_recipe(source)


def own_text(source: str) -> str:
    """Return the text of a recipe file, for a process that cannot read the file, or only later; a name is kept.

    Raises RecipeError.
    """
    load_recipe(source)
    if "\n" in source or source in shipped_recipes():
        return source
    return read_toml_text(Path(source))


def load_bench(source: str) -> BenchFile:
    """Return a bench by shipped name or path; raises BadBench naming the file and the key."""
    try:
        return checked_settings(read_bench(source))
    except FileNotFoundError:
        names = ", ".join(shipped_benches())
        raise BadBench(f"bench {source!r} is neither a file nor a bench that ships with labctl ({names})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, IsADirectoryError) as error:
        raise BadBench(f"bench file {source}: not TOML: {error}; correct it") from error
    except ValidationError as error:
        raise BadBench(f"bench file {source}: {_first(error)}") from error


def with_drivers(bench: BenchFile) -> BenchFile:
    """Return a bench with its sections by the models of their drivers; raises BadBench naming the key."""
    try:
        return resolve(bench)
    except ValidationError as error:
        raise BadBench(f"bench {bench.name}: {_first(error)}") from error


def _first(error: ValidationError) -> str:
    """Return the first error as text: its place, what is wrong there, and the value that was given."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"])[:LONGEST_PLACE]
    value_text = "" if first["type"] == "missing" else f" (is {shown(first['input'])})"
    return f"{place}: {first['msg']}{value_text}"


def limits_of(bench: BenchFile, *, driven: bool = False, earlier: EarlierTimes | None = None) -> BenchLimits:
    """Return what a bench's instruments may be asked for, from its file alone.

    `driven` is for a campaign, in which the table has to be able to follow the courses of a recipe. `earlier` is what
    earlier campaigns took, for the forecast.
    """
    table, chamber = bench.table, bench.chamber
    return BenchLimits(
        None
        if table is None
        else TableLimits(
            table.max_rate_dps,
            table.acceleration_dps2,
            360.0 / table.steps_per_turn,
            clock_run_s=getattr(table, "clock_run_s", 0.0),  # keys of a driver's own model
            checks_home=getattr(table, "check_home", False),
            follows_courses=getattr(table, "follows_courses", False),
        ),
        None
        if chamber is None
        else ChamberLimits(chamber.min_c, chamber.max_c, USUAL_RESOLUTION_C, chamber.ramp_c_per_min),
        {gyro.name: GyroLimits(gyro.max_rate_dps, gyro.min_c, gyro.max_c) for gyro in bench.gyros},
        needs_person=bench.needs_person,
        is_driven=driven,
        air_tau_s=bench.air_tau_s,
        earlier=earlier,
        tilted_positions=bench.tilted_positions,
        supply=_supply_limits(bench),
        eccentricity=bench.eccentricity,
    )


def _supply_limits(bench: BenchFile) -> SupplyLimits | None:
    supply = bench.supply
    if supply is None:
        return None
    return SupplyLimits(supply.nominal_v, supply.min_v, supply.max_v, supply.current_limit_a, supply.tolerance_v)


def bench_for(recipe: Recipe, *, driven: bool = False) -> str:
    """Return the shipped simulated bench that fits a recipe best.

    One that is named after it; else the one with the fewest axes that can do it whole, the fastest of these first, and
    a table with an encoder last. One with the unit of a paper is chosen by its own name only: its errors are special.
    """
    if f"{recipe.name}-sim" in shipped_benches():
        return f"{recipe.name}-sim"
    axes = {axis for position in recipe.positions for axis in Position.of(position).axes}
    fitting: list[tuple[bool, int, float, bool, str]] = []
    for name, path in shipped_benches().items():
        if name.endswith(OF_A_PAPER):
            continue
        bench = load_bench(str(path))
        recorded = {axis for gyro in bench.gyros for axis in gyro.axes}
        if bench.is_simulated and axes <= recorded and not missing_instruments(recipe, limits_of(bench)):
            has_encoder = getattr(bench.table, "reference", "computed") != "computed"  # a key of a driver's own model
            can = _can_do(recipe, bench, driven=driven)
            fitting.append((not can, len(recorded), -bench.gyros[0].max_rate_dps, has_encoder, name))
    if not fitting:
        raise BadBench(
            f"recipe {recipe.name}: no bench that comes with labctl measures the axes {sorted(axes)}; name a "
            "bench file with --bench FILE"
        )
    return min(fitting)[-1]


def _can_do(recipe: Recipe, bench: BenchFile, *, driven: bool) -> bool:
    try:
        make_plan(recipe, limits_of(bench, driven=driven))
    except PlanRefused:
        return False
    return True


def plan_for(
    recipe_source: str, bench_source: str | None, *, clip: bool, store: Store | None = None, check: Check = no_check
) -> tuple[Plan, BenchFile, EarlierTimes | None]:
    """Return the plan of a recipe on a bench, and what its forecast takes from the earlier campaigns of `store`.

    `check` may refuse it. Raises RecipeError, BadBench, PlanRefused.
    """
    recipe = load_recipe(recipe_source)
    check_fit(recipe)
    bench = load_bench(bench_source or bench_for(recipe, driven=True))
    earlier = times_on_bench(store, bench)
    plan = make_plan(recipe, limits_of(bench, driven=True, earlier=earlier), clip=clip)
    check(plan, bench)
    return plan, bench, earlier
