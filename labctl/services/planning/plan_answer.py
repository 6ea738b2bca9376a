"""What a plan answers: its figures, what it could find, and when it needs a person."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from datetime import date, datetime
from itertools import product
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from instruments.bench_config import USUAL_AIR_TAU_S, BenchFile
from instruments.positions import Position
from labctl.answers.plans import FurtherMountings, MisalignmentOutlook, PlanResponse, Visibility
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.mounting_angles import ANGLE_QUANTITIES, angle_gains, shares_of, tilted_beside
from labctl.fitting.data.tilted_mountings import TILTED, has_tilted
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.standard_lines import Sensitivities, standards_u
from labctl.services.planning.attendance import attendance, visits_s
from labctl.services.planning.earlier_campaigns import learned_texts
from labctl.services.planning.loading import Check, limits_of, no_check, plan_for
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire, CheckHome, Home, Mount, MoveChamber
from procedures.planning.earlier_times import EarlierTimes
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.planning.step_writer import CHECK_S, HOMING_S
from procedures.recipe.recipe import Recipe
from procedures.recipe.rules import Indexing, Inverted

if TYPE_CHECKING:
    from labctl.store import Store

#: Coverage factor of the figures.
K = 2.0
#: Whether a standard is overdue does not matter here.
ANY_DAY = date(1970, 1, 1)
#: Mountings that leave more than this share of U are not offered.
WORTH_SHARE = 0.98
#: What can be turned once more, in words, by which key of `[indexing]`, and by how much, deg.
TURNS = (
    ("each unit turned by 180 deg on its face", "unit_deg", 180),
    ("the fixture turned by 180 deg on the table", "fixture_deg", 180),
    ("the fixture turned by 90 deg on the table", "fixture_deg", 90),
)


def misalignment_outlook(plan: Plan, bench: BenchFile, limits: BenchLimits) -> MisalignmentOutlook | None:
    """Return U of a misalignment by fixture and table, of the plan and with further mountings added.

    None where no unit turns about an axis across one of its outputs, or where the bench states no such standard.
    """
    shares = _shares(plan, bench)
    counted = (*ANGLE_QUANTITIES, *((TILTED,) if has_tilted(shares) else ()))
    stated = sorted({each.quantity for each in bench.standards} & set(counted))
    if not shares or not stated:
        return None
    now = _expanded(bench, shares)
    outlooks = []
    for what, table, wider in _wider(plan.recipe):
        try:
            other = make_plan(wider, limits)
        except PlanRefused:
            continue
        then = _shares(other, bench)
        if (expanded := _expanded(bench, then)) > WORTH_SHARE * now:
            continue
        more = FurtherMountings(
            turned=what, expanded=expanded, mountings=len(then) - len(shares),
            more_s=other.expected_s - plan.expected_s, recipe_toml=table,
        )  # fmt: skip
        outlooks.append(more)
    return MisalignmentOutlook(
        expanded=now, further=sorted(outlooks, key=lambda each: (each.expanded, each.more_s)),
        not_stated=[each for each in counted if each not in stated],
    )  # fmt: skip


def _shares(plan: Plan, bench: BenchFile) -> dict[str, float]:
    """Return position -> its share in what is known of misalignments: where a unit has an output across the axis.

    Tilted mountings are left out where the others separate their angles.
    """
    across = {axis for axis in BODY_AXES for gyro in bench.gyros if set(gyro.axes) - {axis}}
    weights: dict[str, float] = {}
    for step in plan.steps:
        if isinstance(step, Acquire) and not step.verification and across & set(Position.of(step.position).axes):
            weights[step.position] = weights.get(step.position, 0.0) + step.rate_dps**2
    separated = {str(position) for position in tilted_beside(weights)}
    weights = {position: weight for position, weight in weights.items() if position not in separated}
    return shares_of(weights) if any(weights.values()) else {}


def _expanded(bench: BenchFile, shares: dict[str, float]) -> float:
    """Return U of the misalignment towards the axis whose mountings separate least; tilted, of any element."""
    stated = tuple(each for each in bench.standards if each.quantity in (*ANGLE_QUANTITIES, TILTED))
    conditions = BenchConditions(ANY_DAY, standards=stated, mountings=shares)
    if conditions.has_tilted:
        elements = product(BODY_AXES, repeat=2)
        gains = [conditions.element_gains(output, about) for output, about in elements]
        return max(K * standards_u(conditions, Sensitivities.of_one(angle=1.0, gains=each)) for each in gains)
    return max(
        K * standards_u(conditions, Sensitivities.of_one(angle=1.0, gains=angle_gains(shares, axis)))
        for axis in {Position.of(position).axis for position in shares}
    )


def _wider(recipe: Recipe) -> Iterator[tuple[str, str, Recipe]]:
    """Yield what is turned, the table that the recipe then has, and the recipe with each position once more turned so.

    A recipe that turns something already keeps its table, with one angle more.
    """
    fastest = max(recipe.rates_dps, key=abs)
    if fastest == 0:
        return
    points = {"temperatures_c": (_temperature_c(recipe),), "rates_dps": (fastest, -fastest)}
    table: dict[str, Any] = {**points, "hold_s": 0.0}
    if recipe.indexing is not None:
        table = recipe.indexing.model_dump(exclude_defaults=True)
    for what, key, angle in TURNS:
        angles = table.get(key, ())
        if angle not in angles:
            indexing = Indexing.model_validate({**table, key: (*angles, angle)})
            yield what, _toml("indexing", indexing), recipe.model_copy(update={"indexing": indexing})
    listed = set(recipe.positions)
    if recipe.inverted is None and not all(str(Position.of(each).upside_down) in listed for each in listed):
        inverted = Inverted.model_validate(points)
        yield "each unit upside down", _toml("inverted", inverted), recipe.model_copy(update={"inverted": inverted})


def _toml(name: str, table: Indexing | Inverted) -> str:
    """Return a table of a recipe as TOML, a line for each key."""
    document = table.model_dump(exclude_defaults=True)
    lines = [
        f"{key} = [{', '.join(f'{each:g}' for each in value)}]" if isinstance(value, tuple) else f"{key} = {value:g}"
        for key, value in document.items()
    ]
    return "\n".join([f"[{name}]", *lines])


def _temperature_c(recipe: Recipe) -> float:
    """Return where the chamber is when a unit is turned, or the end of the recipe's range that is next to it."""
    low, high = min(recipe.temperatures_c), max(recipe.temperatures_c)
    handling_c = recipe.mounting.handling_c
    return low if handling_c is None else min(max(handling_c, low), high)


Look = Callable[[Plan, BenchFile], list[Visibility]]
#: When a plan would begin, and the time zone of the people at the bench.
LocalStart = tuple[datetime, ZoneInfo]


def describe_plan(
    recipe: str, bench: str | None, *, clip: bool, look: Look | None = None, start: LocalStart | None = None,
    store: Store | None = None, check: Check = no_check,
) -> PlanResponse:  # fmt: skip
    """Say what a campaign would do and how long it takes, by the earlier campaigns of `store`; see `plan_answer`.

    `check` may refuse the plan.
    """
    plan, bench_file, earlier = plan_for(recipe, bench, clip=clip, store=store, check=check)
    return plan_answer(plan, bench_file, look, start, earlier)


def plan_answer(
    plan: Plan, bench_file: BenchFile, look: Look | None = None, start: LocalStart | None = None,
    earlier: EarlierTimes | None = None,
) -> PlanResponse:  # fmt: skip
    """Return a plan's figures; `look` also says what it could find, `start` when it needs a person.

    `earlier` is what it takes from earlier campaigns on the bench.
    """
    return PlanResponse(
        recipe=plan.recipe.name,
        bench=bench_file.name,
        steps=len(plan.steps),
        datasets=plan.datasets,
        expected_s=plan.expected_s,
        guessed=_guessed(plan, bench_file, earlier),
        learned=list(learned_texts(earlier, needs_person=bench_file.needs_person)),
        verification_datasets=sum(isinstance(step, Acquire) for step in plan.verification_steps),
        verification_s=math.fsum(step.expected_s for step in plan.verification_steps),
        clipped=list(plan.clipped),
        schedule_hash=plan.schedule_hash,
        misalignment=misalignment_outlook(plan, bench_file, limits_of(bench_file, earlier=earlier)),
        visibility=look(plan, bench_file) if look else None,
        attendance=attendance(visits_s(plan, bench_file), *start) if start else None,
    )


def _guessed(plan: Plan, bench: BenchFile, earlier: EarlierTimes | None) -> list[str]:
    """Return the figures of the expected time that neither a file nor an earlier campaign states, in words."""
    known = earlier or EarlierTimes(0)
    taken = {type(step) for step in plan.steps if step.expected_s}
    guesses: list[str] = []
    if Home in taken and known.home_s is None:
        guesses.append(f"homing takes {HOMING_S:g} s")
    if CheckHome in taken and known.check_home_s is None:
        guesses.append(f"a check for missed steps takes {CHECK_S:g} s")
    if MoveChamber in taken and bench.air_tau_s is None and known.heating is None and known.cooling is None:
        guesses.append(
            f"the air of the chamber follows a ramp with a time constant of {USUAL_AIR_TAU_S:g} s; state air_tau_s in "
            "[chamber] of the bench file"
        )
    mounts = [step.expected_s for step in plan.steps if isinstance(step, Mount) and step.expected_s]
    if mounts and (known.mount_s is None or plan.recipe.turns is not None):
        guesses.append(f"a person takes {mounts[0] / 60:g} min to mount the units")
    return guesses
