"""Whether U of a table's step clock holds the truth: timed runs behind late replies, of clocks that drift.

Runs go through the driver and the bytes of a simulated controller. Its replies are late by a random part of the
period of an adapter's timer, or by the rest to its next tick, and by what the computer's scheduler adds. The clock
drifts in proportion to time, as it does when a controller warms up, or as a random walk. A campaign has one block of
runs before its data sets and one every two hours. `LABCTL_STUDY_CAMPAIGNS` is how many of each kind,
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
from procedures.planning.clock_runs import BLOCK_EVERY_S, FIRST_RUNS, LATER_RUNS, run_lengths_s

CAMPAIGNS = int(os.environ.get("LABCTL_STUDY_CAMPAIGNS", "200"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "32001"))
LATENCIES_S = (0.0, 0.001, 0.004, 0.016)
BLOCKS = 4
OFF_PPM, SCHEDULER_S, RATE_DPS = 350.0, 1e-4, 90.0
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


def campaign(kind: Kind, latency_s: float, seed: tuple[int, ...]) -> tuple[float, float, float]:
    """Return of one campaign the share of its rates inside U, U in ppm, and the error of their mean over U."""
    rng, clock = np.random.default_rng(seed), VirtualClock()
    opened = open_bench(bench(), clock)
    table: Any = opened.table
    device: Any = opened.simulation.device("sim://arrick")._device  # type: ignore[union-attr]  # noqa: SLF001
    device.passed_on_s = LateReplies(kind, latency_s, rng)
    ppm, runs, planned, times_s = kind.ppm(rng), [], 0, []
    found: MeasuredClock | None = None
    try:
        table.home()
        for block in range(BLOCKS):
            number = LATER_RUNS if block else FIRST_RUNS
            for steady_s in run_lengths_s(number, planned, 10.0, table.limits.clock_run_s):
                device.clock_ratio = 1.0 + 1e-6 * (ppm(clock.now_s() + steady_s / 2) - OFF_PPM)
                run = table.time_run(RATE_DPS, steady_s, clock.sleep)
                middle_s = run.began_s + run.duration_s / 2
                runs.append(ClockRun(1, block, middle_s, run.nominal_s, run.duration_s, run.step_hz))
            planned += number
            found = measured(runs, table.step_clock)
            if block < BLOCKS - 1:
                times_s += [clock.now_s() + BLOCK_EVERY_S * (n + 0.5) / TIMES for n in range(TIMES)]
                clock.sleep(BLOCK_EVERY_S)
    finally:
        opened.close()
    assert found is not None
    true = np.array([1.0 + 1e-6 * (ppm(t_s) - OFF_PPM) for t_s in times_s])
    errors_ppm = 1e6 * (np.array([found.fit.ratio(t_s) for t_s in times_s]) / true - 1.0)
    inside = float(np.mean(np.abs(errors_ppm) <= found.expanded_ppm))
    return inside, found.expanded_ppm, float(errors_ppm.mean() / found.expanded_ppm)


def run(campaigns: int = CAMPAIGNS) -> str:
    """Return the share of rates inside U by latency and drift, with its 95 % interval over campaigns."""
    lines = [
        f"| drift | latency, ms | U, ppm | rates inside U, % of {campaigns} campaigns | mean inside U, % |",
        "| --- | --- | --- | --- | --- |",
    ]
    for k, kind in enumerate(KINDS):
        for latency_s in LATENCIES_S:
            key = (FIRST_SEED, k, round(1e3 * latency_s))
            every = np.array([campaign(kind, latency_s, (*key, n)) for n in range(campaigns)])
            share, half = 100 * every[:, 0].mean(), 196 * every[:, 0].std(ddof=1) / math.sqrt(campaigns)
            means = 100 * float(np.mean(np.abs(every[:, 2]) <= 1))
            lines.append(
                f"| {kind.drift} | {1e3 * latency_s:g} | {np.median(every[:, 1]):.2g} | {share:.1f} "
                f"({share - half:.1f} to {min(share + half, 100):.1f}) | {means:.1f} |"
            )
    return "\n".join(lines)
