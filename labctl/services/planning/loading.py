"""From a recipe and a bench to a plan; nothing is opened and nothing moves."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from zoneinfo import ZoneInfo

from pydantic import JsonValue, ValidationError

from instruments.bench import checked_settings
from instruments.bench_config import BenchFile, read_bench, shipped_benches
from instruments.drivers.resolution import resolve
from instruments.interfaces.chamber import ChamberLimits
from instruments.interfaces.gyro import GyroLimits
from instruments.interfaces.table import TableLimits
from instruments.positions import Position
from instruments.toml_documents import read_toml_text, shown
from labctl.errors import BadBench
from labctl.services.planning.attendance import attendance, visits_s
from labctl.services.planning.fit_rules import check_fit
from labctl.services.planning.mountings import misalignment_outlook
from labctl.services.schemas.plans import PlanResponse, Visibility
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire
from procedures.planning.limits import BenchLimits, missing_instruments
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe, parse_recipe, read_recipe, shipped_recipes

#: Of a chamber's set point, until its controller has been asked.
USUAL_RESOLUTION_C = 0.1
#: A key of a bench file that is not known is shown up to here.
LONGEST_PLACE = 80


Look = Callable[[Plan, BenchFile], list[Visibility]]
#: When a plan would begin, and the time zone of the people at the bench.
LocalStart = tuple[datetime, ZoneInfo]
#: End of the name of a shipped bench that simulates the unit of a paper.
OF_A_PAPER = "-paper-sim"


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


def recipe_document(recipe: Recipe) -> dict[str, JsonValue]:
    """Return a recipe as a recipe file says it; keys that have their default are left out."""
    document = recipe.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    if recipe.turns is not None:
        document = {key: value for key, value in document.items() if value != []}  # it has no rates
    return {"format": "labctl-recipe/1", "name": recipe.name, **document}


def load_bench(source: str) -> BenchFile:
    """Return a bench by shipped name or path; raises BadBench naming the file and the key."""
    try:
        return checked_settings(read_bench(source))
    except FileNotFoundError:
        known = ", ".join(shipped_benches())
        raise BadBench(f"bench {source!r} is neither a file nor a bench that ships with labctl ({known})") from None
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
    """Say the first thing that is wrong: its place, what is wrong there, and the value that was given."""
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"])[:LONGEST_PLACE]
    given = "" if first["type"] == "missing" else f" (is {shown(first['input'])})"
    return f"{place}: {first['msg']}{given}"


def limits_of(bench: BenchFile, *, driven: bool = False) -> BenchLimits:
    """Return what a bench's instruments may be asked for, from its file alone.

    `driven` is for a campaign, in which the table has to be able to follow the courses of a recipe.
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
        is_driven=driven,
    )


def bench_for(recipe: Recipe, *, driven: bool = False) -> str:
    """Return the shipped simulated bench that fits a recipe best.

    One that is named after it; else the one with the fewest axes that can do it whole, the fastest of these first, and
    a table with an encoder last. One with the unit of a paper is chosen by its own name only: its errors are special.
    """
    if f"{recipe.name}-sim" in shipped_benches():
        return f"{recipe.name}-sim"
    axes = {Position.of(position).axis for position in recipe.positions}
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


def plan_for(recipe_source: str, bench_source: str | None, *, clip: bool) -> tuple[Plan, BenchFile]:
    """Return the plan of a recipe on a bench. Raises RecipeError, BadBench, PlanRefused."""
    recipe = load_recipe(recipe_source)
    check_fit(recipe)
    bench = load_bench(bench_source or bench_for(recipe, driven=True))
    return make_plan(recipe, limits_of(bench, driven=True), clip=clip), bench


def describe_plan(
    recipe: str, bench: str | None, *, clip: bool, look: Look | None = None, start: LocalStart | None = None
) -> PlanResponse:
    """Say what a campaign would do and how long it takes, as `plan_answer` does."""
    plan, bench_file = plan_for(recipe, bench, clip=clip)
    return plan_answer(plan, bench_file, look, start)


def plan_answer(
    plan: Plan, bench_file: BenchFile, look: Look | None = None, start: LocalStart | None = None
) -> PlanResponse:
    """Return a plan's figures; `look` also says what it could find, `start` when it needs a person."""
    return PlanResponse(
        recipe=plan.recipe.name,
        bench=bench_file.name,
        steps=len(plan.steps),
        datasets=plan.datasets,
        expected_s=plan.expected_s,
        verification_datasets=sum(isinstance(step, Acquire) for step in plan.verification_steps),
        verification_s=math.fsum(step.expected_s for step in plan.verification_steps),
        clipped=list(plan.clipped),
        schedule_hash=plan.schedule_hash,
        misalignment=misalignment_outlook(plan, bench_file, limits_of(bench_file)),
        visibility=look(plan, bench_file) if look else None,
        attendance=attendance(visits_s(plan, bench_file), *start) if start else None,
    )
