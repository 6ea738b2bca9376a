"""The [stop] of a recipe, checked before a campaign begins: a U that the bench cannot reach is refused."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from instruments.bench_config import BenchFile
from instruments.positions import AXES, Position
from labctl.recording import RecordingInfo
from labctl.recording.info import NO_DATE
from labctl.services.benches.standards import standards_of
from labctl.services.planning.loading import with_drivers
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire, PowerOn
from procedures.planning.plan import Plan

if TYPE_CHECKING:
    from labctl.fitting.uncertainty.over_range import Range

STATE_REPEATABILITY = (
    "Switch the units off between mountings (mounting.repower_each = true), or leave a later power-on out of U "
    "(stop.repeatability = false)."
)
TOO_SMALL = "No campaign on this bench is long enough; ask for a larger u_dps or a smaller range."
MEASURE_THERE = "U needs data sets near both ends, half-way and the middle of the range; measure there, or narrow it."


def check_stop_on(plan: Plan, bench: BenchFile) -> None:
    """Raise PlanRefused as `check_stop` does, by what the file of a bench says of its units and standards."""
    if plan.recipe.stop is None:
        return
    bench = with_drivers(bench)
    check_stop(
        plan,
        [
            RecordingInfo(
                serial=gyro.serial, axes=gyro.axes, kind="samples", started_at=NO_DATE, datasheet=gyro.datasheet,
                datasheet_conventions=gyro.datasheet_conventions, standards=standards_of(bench),
                latitude_deg=bench.latitude_deg,
            )
            for gyro in bench.gyros
        ],
    )  # fmt: skip


def check_stop(plan: Plan, units: Iterable[RecordingInfo]) -> None:
    """Raise PlanRefused for a U of [stop] that no campaign on this bench can reach, with what it cannot fall below."""
    rules = plan.recipe.stop
    if rules is None:
        return
    from labctl.fitting.uncertainty.over_range import Range, unreachable_below  # noqa: PLC0415  it loads a lot

    runs = sum(isinstance(step, PowerOn) for step in plan.steps)
    over = Range(
        rules.rates_dps or _ends(plan.recipe.rates_dps),
        rules.temperature_c or _ends(plan.recipe.temperatures_c),
        rules.repeatability,
    )
    for info in units:
        _check_near(plan, info, over)
        least = unreachable_below(info, over, runs)
        if least.u_dps is None:
            text = f"U of unit {info.serial} stays unknown: {least.why}"
            raise PlanRefused(plan.recipe.name, [text], STATE_REPEATABILITY)
        if least.u_dps >= rules.u_dps:
            source, part = max((least.parts_dps or {}).items(), key=lambda each: each[1])
            text = (
                f"stop.u_dps = {rules.u_dps:g} deg/s cannot be reached by unit {info.serial}: U is at least "
                f"{least.u_dps:.2g} deg/s at {least.rate_dps:g} deg/s about {least.axis}, mostly by {source} (standard "
                f"uncertainty {part:.2g} deg/s)"
            )
            raise PlanRefused(plan.recipe.name, [text], TOO_SMALL)


def _check_near(plan: Plan, info: RecordingInfo, over: Range) -> None:
    """Raise PlanRefused where no data set of the plan is near some place of the range."""
    from labctl.fitting.uncertainty.over_range import not_near  # noqa: PLC0415  it loads a lot

    steps = [step for step in plan.steps if isinstance(step, Acquire) and not step.verification]
    warm = np.array([step.temperature_c for step in steps])
    for axis in info.axes:
        positions = [Position.of(step.position) for step in steps]
        rates = [step.rate_dps * position.up[AXES.index(axis)] for step, position in zip(steps, positions, strict=True)]
        if place := not_near(np.array(rates), warm, over):
            text = f"U of unit {info.serial} about {axis} stays unknown: {place}"
            raise PlanRefused(plan.recipe.name, [text], MEASURE_THERE)


def _ends(values: tuple[float, ...]) -> tuple[float, float]:
    return min(values), max(values)
