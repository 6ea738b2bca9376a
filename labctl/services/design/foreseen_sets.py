"""The data sets of a plan, with the temperatures that the unit is expected to have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.fitting.design.heat_course import HeatFlow, heat_course
from labctl.fitting.design.planned_sets import PlannedSets
from procedures.contracts.steps import Acquire, MoveChamber, PowerOn, SetSupply, Step
from procedures.planning.plan import Plan
from procedures.planning.step_writer import ROOM_C


def foreseen_sets(
    plan: Plan, flow: HeatFlow, acceleration_dps2: float, nominal_v: float | None = None
) -> PlannedSets:  # fmt: skip
    """Return the data sets of a plan that are fitted, each step taking as long as expected.

    `nominal_v` is the voltage of the units' supply before any step of it, where the bench sets it.
    """
    sets, set_points, end_s = _timed(plan.steps, acceleration_dps2, nominal_v or 0.0)
    begin, duration, rate, position, run, mounting, on, supply_v = zip(*sets, strict=True)
    return PlannedSets(
        np.array(begin), np.array(duration), np.array(rate, dtype=np.float64), np.array(position, dtype=np.str_),
        np.array(run, dtype=np.int64), np.array(mounting, dtype=np.int64), np.array(on, dtype=np.float64),
        heat_course(flow, set_points, ROOM_C, end_s), None if nominal_v is None else np.array(supply_v),
    )  # fmt: skip


#: Begin, duration, rate, position, run, mounting, time since switching on and supply voltage of a data set.
Row = tuple[float, float, float, str, int, int, float, float]


def _timed(
    steps: Sequence[Step], acceleration_dps2: float, supply_v: float
) -> tuple[list[Row], list[tuple[float, float]], float]:
    """Return the data sets, the set points with their times, and the end of the last data set, s."""
    sets: list[Row] = []
    set_points: list[tuple[float, float]] = []
    now_s, on_s = 0.0, 0.0
    for step in steps:
        if isinstance(step, MoveChamber):
            set_points.append((now_s, step.temperature_c))
        elif isinstance(step, PowerOn):
            on_s = now_s
        elif isinstance(step, SetSupply):
            supply_v = step.voltage_v
        elif isinstance(step, Acquire) and not step.verification:
            begin_s = now_s + step.settle_s + abs(step.rate_dps) / acceleration_dps2
            row = begin_s, step.duration_s, step.rate_dps, step.position, step.run, step.mounting, begin_s - on_s
            sets.append((*row, supply_v))
        now_s += step.expected_s
    return sets, set_points, now_s
