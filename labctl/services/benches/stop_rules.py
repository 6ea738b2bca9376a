"""The [stop] of a recipe, checked before a campaign begins: a U that the bench cannot reach is refused."""

from __future__ import annotations

from collections.abc import Iterable

from instruments.bench_config import BenchFile
from labctl.recording import RecordingInfo
from labctl.recording.info import NO_DATE
from labctl.services.benches.standards import standards_of
from labctl.services.planning.loading import with_drivers
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import PowerOn
from procedures.planning.plan import Plan

STATE_REPEATABILITY = (
    "Switch the units off between mountings (mounting.repower_each = true), or leave a later power-on out of U "
    "(stop.repeatability = false)."
)
TOO_SMALL = "No campaign on this bench is long enough; ask for a larger u_dps or a smaller range."


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


def _ends(values: tuple[float, ...]) -> tuple[float, float]:
    return min(values), max(values)
