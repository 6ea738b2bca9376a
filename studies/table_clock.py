"""Whether U of a table's step clock holds the truth: timed runs behind late replies, of clocks that drift.

Runs go through the driver and the bytes of a simulated controller. Its replies are late by a random part of the
period of an adapter's timer, or by the rest to its next tick, and by what the computer's scheduler adds. The clock
drifts in proportion to time, as it does when a controller warms up, or as a random walk. A campaign has one block of
runs before its data sets and one every two hours. Each controller's clock is off by its own amount, so that ticks
fall otherwise in each campaign. `LABCTL_STUDY_CAMPAIGNS` is how many of each kind,
`LABCTL_STUDY_SEED` the first seed.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from procedures.contracts.journal import ClockRun
from procedures.monitoring.step_clock import MeasuredClock, measured
from procedures.planning.clock_runs import BLOCK_EVERY_S, FIRST_RUNS, LATER_RUNS, drawn_lengths_s, run_lengths_s
from studies.report_tables import wilson

CAMPAIGNS = int(os.environ.get("LABCTL_STUDY_CAMPAIGNS", "1000"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "32001"))
LATENCIES_S = (0.0, 0.001, 0.004, 0.016)
BLOCKS = 4
MAX_OFF_PPM, SCHEDULER_S, RATE_DPS = 500.0, 1e-4, 90.0
#: Rates are compared at so many times between two blocks.
TIMES = 8


@dataclass(frozen=True)
class Kind:
    """How a clock drifts and how replies are late."""

    drift: str
    ppm: Callable[[np.random.Generator], Callable[[float], float]]  #: -> deviation at a time, s
    at_ticks: bool = False


def _steady(_rng: np.random.Generator) -> Callable[[float], float]:
    return lambda _t_s: 0.0


def _linear(rng: np.random.Generator) -> Callable[[float], float]:
    per_h = float(rng.uniform(-10.0, 10.0))
    return lambda t_s: per_h * t_s / 3600.0


def _warming(rng: np.random.Generator) -> Callable[[float], float]:
    size, tau_s = float(rng.uniform(-10.0, 10.0)), float(rng.uniform(1800.0, 7200.0))
    return lambda t_s: size * (1.0 - math.exp(-t_s / tau_s))


def _walk(rng: np.random.Generator) -> Callable[[float], float]:
    steps = np.cumsum(rng.normal(0.0, 1.0, 200)) * math.sqrt(300.0 / 3600.0)  # 1 ppm in an hour, each 300 s
    return lambda t_s: float(np.interp(t_s, 300.0 * np.arange(200), steps))


KINDS = (
    Kind("none", _steady),
    Kind("up to 10 ppm/h", _linear),
    Kind("up to 10 ppm, warming up", _warming),
    Kind("random walk, 1 ppm in 1 h", _walk),
    Kind("none; replies at ticks", _steady, at_ticks=True),
    Kind("up to 10 ppm/h; replies at ticks", _linear, at_ticks=True),
)


def bench() -> BenchFile:
    """Return the shipped bench with one axis, whose table measures its step clock."""
    record = read_bench("single-axis-sim").model_dump()
    record["table"] |= {"clock_run_s": 60.0}
    return resolve(BenchFile.model_validate(record))


class LateReplies:
    """Makes replies of a simulated controller late, each by its own part of the period of an adapter's timer."""

    def __init__(self, kind: Kind, latency_s: float, rng: np.random.Generator) -> None:
        self._kind, self._latency_s, self._rng = kind, latency_s, rng
        self._phase_s = float(rng.uniform(0.0, latency_s))

    def __call__(self, due_s: float) -> float:
        """Return when bytes that were sent reach the program."""
        late_s = float(self._rng.exponential(SCHEDULER_S))
        if not self._latency_s:
            return due_s + late_s
        if not self._kind.at_ticks:
            return due_s + late_s + float(self._rng.uniform(0.0, self._latency_s))
        ticks = math.ceil((due_s - self._phase_s) / self._latency_s)
        return self._phase_s + ticks * self._latency_s + late_s


class TimedTable:
    """A simulated table whose step clock is timed, from the bytes of its controller."""

    def __init__(self, kind: Kind, latency_s: float, rng: np.random.Generator) -> None:
        self.clock = VirtualClock()
        self._opened = open_bench(bench(), self.clock)
        self.table: Any = self._opened.table
        device: Any = self._opened.simulation.device("sim://arrick")  # type: ignore[union-attr]
        self._device = device._device  # noqa: SLF001
        self._kind, self._latency_s, self._rng = kind, latency_s, rng
        self._off_ppm = float(rng.uniform(-MAX_OFF_PPM, MAX_OFF_PPM))
        self._ppm = kind.ppm(rng)
        self.runs: list[ClockRun] = []
        self.connect()
        self.table.home()

    def connect(self) -> None:
        """Begin a session: the timer of the adapter has another phase."""
        self._device.passed_on_s = LateReplies(self._kind, self._latency_s, self._rng)

    def ratio(self, t_s: float) -> float:
        """Return the true step rate over the nominal one at a time, s."""
        return 1.0 + 1e-6 * (self._ppm(t_s) + self._off_ppm)

    def time_block(self, number: int, session: int, block: int) -> MeasuredClock | None:
        """Time some runs; returns the clock by all so far."""
        planned_s = run_lengths_s(number, len(self.runs), 10.0, self.table.limits.clock_run_s)
        for steady_s in drawn_lengths_s(planned_s, self._rng):
            self._device.clock_ratio = self.ratio(self.clock.now_s() + steady_s / 2)
            run = self.table.time_run(RATE_DPS, steady_s, self.clock.sleep)
            middle_s = run.began_s + run.duration_s / 2
            self.runs.append(ClockRun(session, block, middle_s, run.nominal_s, run.duration_s, run.step_hz))
        return measured(self.runs, self.table.step_clock)

    def close(self) -> None:
        """Close the bench."""
        self._opened.close()


def campaign(kind: Kind, latency_s: float, seed: tuple[int, ...]) -> tuple[float, float, float]:
    """Return of one campaign the share of its rates inside U, U in ppm, and the error of their mean over U."""
    timed, times_s = TimedTable(kind, latency_s, np.random.default_rng(seed)), []
    found: MeasuredClock | None = None
    try:
        for block in range(BLOCKS):
            found = timed.time_block(LATER_RUNS if block else FIRST_RUNS, 1, block)
            if block < BLOCKS - 1:
                times_s += [timed.clock.now_s() + BLOCK_EVERY_S * (n + 0.5) / TIMES for n in range(TIMES)]
                timed.clock.sleep(BLOCK_EVERY_S)
    finally:
        timed.close()
    assert found is not None
    true = np.array([timed.ratio(t_s) for t_s in times_s])
    errors_ppm = 1e6 * (np.array([found.fit.ratio(t_s) for t_s in times_s]) / true - 1.0)
    inside = float(np.mean(np.abs(errors_ppm) <= found.expanded_ppm))
    return inside, found.expanded_ppm, float(errors_ppm.mean() / found.expanded_ppm)


def resumed_campaign(kind: Kind, latency_s: float, seed: tuple[int, ...]) -> tuple[float, float]:
    """Return the error of the deviation that a resumed campaign states at its end, and its U, both in ppm.

    Its runs are those before the first data set, as many when it is resumed half an hour later, and two at the end.
    """
    timed = TimedTable(kind, latency_s, np.random.default_rng(seed))
    try:
        timed.time_block(FIRST_RUNS, 1, 1)
        timed.clock.sleep(1800.0)
        timed.connect()
        timed.time_block(FIRST_RUNS, 2, 2)
        timed.clock.sleep(1800.0)
        found = timed.time_block(LATER_RUNS, 2, 3)
    finally:
        timed.close()
    assert found is not None
    return 1e6 * (found.ratio - timed.ratio(found.fit.until_s)), found.deviation_expanded_ppm


def run(campaigns: int = CAMPAIGNS) -> str:
    """Return the share of rates inside U by latency and drift, with its 95 % interval over campaigns (Wilson)."""
    inside = f"rates inside U, % of {campaigns} campaigns | mean inside U, %"
    lines = [
        f"| drift | latency, ms | U, ppm | RMS error of the mean, ppm | {inside} |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for k, kind in enumerate(KINDS):
        for latency_s in LATENCIES_S:
            key = (FIRST_SEED, k, round(1e3 * latency_s))
            every = np.array([campaign(kind, latency_s, (*key, n)) for n in range(campaigns)])
            low, high = wilson(float(every[:, 0].sum()), campaigns)  # the rates of a campaign have nearly one error
            rms_ppm = math.sqrt(float(np.mean((every[:, 2] * every[:, 1]) ** 2)))
            lines.append(
                f"| {kind.drift} | {1e3 * latency_s:g} | {np.median(every[:, 1]):.3g} | {rms_ppm:.2g} | "
                f"{100 * every[:, 0].mean():.1f} ({100 * low:.1f} to {100 * high:.1f}) | "
                f"{100 * float(np.mean(np.abs(every[:, 2]) <= 1)):.1f} |"
            )
    return "\n".join(lines)
