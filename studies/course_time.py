"""Coverage of a delay whose reference is early or late as a whole: half of a reply that nothing tells.

Each campaign is another noise and another instant between request and reply at which the encoder's angle is taken, on
two ramps and a sine sweep. A table with a lag and a gain of its own, its angles, the replies and the readings of a unit
are worked out by NumPy; what is tried is the course fitted to the angles, the fit, and the budget of the delay.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import cast

import numpy as np

from instruments.clock import VirtualClock
from instruments.interfaces.rate_course import Ramp, RateCourse, SineSweep
from instruments.interfaces.table import AngleReading, CourseRun, CourseTable, reply_time_u_s
from labctl.fitting import fit
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty import Budget, response_budgets
from labctl.recording import Recording, RecordingInfo
from labctl.recording.columns import TIME_COMMON_U_S, TIME_U_S
from procedures.contracts.journal import TableAngles
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.course_reference import CourseLog

CAMPAIGNS = int(os.environ.get("LABCTL_STUDY_COURSE_CAMPAIGNS", "300"))
FIRST_SEED = 1
COURSES: tuple[RateCourse, ...] = (
    Ramp(-50.0, 50.0, 20.0),
    Ramp(50.0, -50.0, 20.0),
    SineSweep(8.0, 0.1, 2.0, 30.0, 2.0),
)
MODEL = ["bias", "scale_factor", "time_delay"]
DELAY_S, SCALE, BIAS_DPS, WHITE_DPS = 0.012, 0.004, 0.03, 0.01
#: The table: how late and how much of the demand it follows, and the noise of its encoder.
LAG_S, GAIN, ANGLE_U_DEG = 0.003, 0.999, 3e-4
#: A reply takes this long at least, and an exponential time more; the times of angles scatter by `TIME_U_S`, s.
REPLY_S, JITTER_S, READ_TIME_U_S = 0.002, 0.0005, 5e-4
READINGS_HZ, FINE_S = 10.0, 1e-3
#: When in a reply an angle is taken: -1 at its request, 1 at its end.
INSTANTS: dict[str, Callable[[np.random.Generator], float]] = {
    "u-shaped": lambda rng: float(np.sin(2 * np.pi * rng.random())),
    "uniform": lambda rng: float(rng.uniform(-1.0, 1.0)),
    "at the request": lambda _: -1.0,
}


@dataclass(frozen=True)
class Found:
    """The delay of one campaign, s: its error and its budget."""

    error_s: float
    budget: Budget


def campaign(seed: int, instant: float) -> Recording:
    """Return the recording of a campaign in which each angle is taken at an instant between request and reply."""
    rng = np.random.default_rng(seed)
    parts = [_data_set(rng, number, course, instant) for number, course in enumerate(COURSES, start=1)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    n = len(columns["t_s"])
    ones = np.ones(n, dtype=np.int64)
    info = RecordingInfo(
        serial="G1", axes=("z",), kind="samples", motion="profile", started_at=datetime(2026, 1, 1, tzinfo=UTC)
    )
    return Recording(info, {**columns, "position": np.full(n, "z"), "run": ones, "mounting": ones})


def _data_set(rng: np.random.Generator, number: int, course: RateCourse, instant: float) -> dict[str, np.ndarray]:
    fine_s = np.arange(-1.0, course.duration_s + 1.0, FINE_S)
    rate = GAIN * np.where(fine_s > LAG_S, course.rate_dps(np.maximum(fine_s - LAG_S, 0.0)), course.begins_dps)
    angle = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * FINE_S)])
    began_s = 100.0 * number
    measured = _measured(rng, CourseRun(course, began_s, 1e-3), fine_s, angle, instant)
    assert measured.course is not None
    assert measured.time is not None
    period_s = 1.0 / READINGS_HZ
    at_s = np.arange(0.5, course.duration_s, period_s)
    ends = [np.interp(at_s - DELAY_S - back, fine_s, angle) for back in (0.0, period_s)]
    n = len(at_s)
    output = (1 + SCALE) * (ends[0] - ends[1]) / period_s + BIAS_DPS + WHITE_DPS * rng.standard_normal(n)
    return {
        "dataset": np.full(n, number), "t_s": at_s + began_s, "gyro_z": output, "temperature_c": np.full(n, 25.0),
        "table_rate_dps": measured.course.rates_dps(at_s + began_s, period_s)[0],
        TIME_U_S: np.full(n, measured.time.own_u_s), TIME_COMMON_U_S: np.full(n, measured.time.common_u_s),
    }  # fmt: skip


def _measured(rng: np.random.Generator, run: CourseRun, fine_s: Array, angle_deg: Array, instant: float) -> TableAngles:
    """Return what an encoder says of a course; an angle's time is the middle between request and reply."""
    middle_s = np.arange(0.05, run.course.duration_s, 0.1)
    n = len(middle_s)
    reply_s = REPLY_S + rng.exponential(JITTER_S, n)
    taken_s = middle_s + instant * reply_s / 2 + READ_TIME_U_S * rng.standard_normal(n)
    read_deg = np.interp(taken_s, fine_s, angle_deg) + ANGLE_U_DEG * rng.standard_normal(n)
    own_u_s = np.hypot(READ_TIME_U_S, (reply_s - reply_s.min()) / np.sqrt(12))
    clock = VirtualClock()
    log = CourseLog(cast("CourseTable", SimpleNamespace()), "table", clock)
    log.readings = [
        AngleReading(run.began_s + t_s, deg, ANGLE_U_DEG, u_s, reply_time_u_s(long_s))
        for t_s, deg, u_s, long_s in zip(
            middle_s.tolist(), read_deg.tolist(), own_u_s.tolist(), reply_s.tolist(), strict=True
        )
    ]
    return log.result(run, CampaignTime(clock, clock.now_s()), is_reference=True)


def found(seed: int, instant: float) -> Found:
    """Return the delay that the fit finds in a campaign, with its budget."""
    budget = response_budgets(fit(campaign(seed, instant), None, MODEL).fitted, evidence={})["z"]["delay"]
    assert budget.value is not None
    return Found(budget.value - DELAY_S, budget)


def covered(campaigns: int, instant: Callable[[np.random.Generator], float], first: int = FIRST_SEED) -> list[Found]:
    """Return the delays of campaigns, each with an instant drawn anew."""
    return [found(seed, instant(np.random.default_rng([seed, 1]))) for seed in range(first, first + campaigns)]


def inside(delays: list[Found]) -> float:
    """Return the share of delays whose error is within U."""
    return float(np.mean([abs(each.error_s) <= (each.budget.expanded or 0.0) for each in delays]))


def run() -> dict[str, float]:
    """Return for each way of drawing the instant: share within U, %, largest error, U and u of the fit alone, ms."""
    figures: dict[str, float] = {}
    for name, instant in INSTANTS.items():
        delays = covered(CAMPAIGNS, instant)
        alone = [line.contribution or 0.0 for each in delays for line in each.budget.lines[:1]]
        figures[f"{name}: within U, %"] = 100.0 * inside(delays)
        figures[f"{name}: largest error, ms"] = 1e3 * max(abs(each.error_s) for each in delays)
        figures[f"{name}: U, ms"] = 1e3 * float(np.median([each.budget.expanded or 0.0 for each in delays]))
        figures[f"{name}: u of the fit alone, ms"] = 1e3 * float(np.median(alone))
    return figures
