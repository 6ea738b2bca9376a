"""Refits of 100,000 units from their means: batched, beside a loop over units and beside lmfit.

lmfit is no dependency of labctl: it is measured where it is installed (`pip install lmfit`). The loop and lmfit fit a
part of the units, and their times are scaled to all. Times are of processor time of one core; `ojeda2000` is a law of
the output, so that each unit has a design of its own, in three outputs of 165 data sets.
"""

from __future__ import annotations

import importlib
import importlib.util
import resource
import statistics
import time
from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import describe
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.fleet.batched import batched_fit
from labctl.fitting.fleet.population import population_of
from labctl.fitting.fleet.refit import refit
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients
from labctl.fitting.models.presets import PRESETS
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_noise import Drift, Scatter
from labctl.fitting.numeric.least_squares import solve
from labctl.recording import Recording, RecordingInfo

UNITS, OF_LOOP, OF_LMFIT, PIECE = 100_000, 1000, 100, 10_000
RATES_DPS, LEVELS_C = np.linspace(-100.0, 100.0, 11), np.array([0.0, 12.0, 25.0, 38.0, 50.0])
DRIFT = Drift(1e-3, 900.0)

Array = NDArray[np.float64]


@single_threaded
def run() -> dict[str, float | str]:
    """Return seconds for 100,000 units, of processor time."""
    peers = ("lmfit",) if importlib.util.find_spec("lmfit") else ()
    found: dict[str, float | str] = {**describe("numpy", "scipy", *peers)}
    found |= _cubic(peers=bool(peers))
    found |= _ojeda()
    found |= _population()
    found["largest_memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return found


def _cubic(*, peers: bool) -> dict[str, float]:
    """Return the times of a cubic in the rate, 21 data sets."""
    rng = np.random.default_rng(1)
    rate = np.linspace(-100.0, 100.0, 21)
    design = np.vander(rate, 4, increasing=True)
    truth = rng.normal(0.0, [0.1, 1e-2, 1e-5, 1e-7], (UNITS, 4))
    y = design @ truth.T + rng.normal(0.0, 2e-3, (21, UNITS))
    scatter = Scatter(60.0 * np.arange(21.0), np.ones(21, dtype=np.int64), rate, np.full(21, 4e-6))
    times = {
        "cubic_batched_s": _cpu_s(lambda: batched_fit(design, y, scatter, DRIFT)),
        "cubic_loop_s": UNITS / OF_LOOP * _cpu_s(
            lambda: [solve(design, y[:, i], scatter, DRIFT) for i in range(OF_LOOP)], 1
        ),
    }  # fmt: skip
    if peers:
        _lmfit(rate, y[:, :2])  # it is imported before it is measured
        times["cubic_lmfit_s"] = UNITS / OF_LMFIT * _cpu_s(lambda: _lmfit(rate, y[:, :OF_LMFIT]), 1)
    return times


def _lmfit(rate: Array, y: NDArray[np.float64]) -> list[object]:
    model = importlib.import_module("lmfit.models").PolynomialModel(3)
    return [model.fit(each, model.make_params(c0=0, c1=0, c2=0, c3=0), x=rate) for each in y.T]


def _ojeda() -> dict[str, float]:
    """Return the time of the published model, three outputs, in pieces of units as a job hands them over."""
    data = _points()
    model, _ = PRESETS["ojeda2000"][0].build(data)
    rng = np.random.default_rng(2)
    drift = dict.fromkeys(data.outputs, DRIFT)
    outputs = {a: v + rng.normal(0.0, 2e-3, (PIECE, len(v))) for a, v in data.outputs.items()}
    return {"ojeda2000_batched_s": UNITS / PIECE * _cpu_s(lambda: refit(data, model, outputs, drift), 3)}


def _points() -> FitData:
    n = len(RATES_DPS) * len(LEVELS_C)
    rate = np.tile(np.tile(RATES_DPS, len(LEVELS_C)), 3)
    warm, position = np.tile(np.repeat(LEVELS_C, len(RATES_DPS)), 3), np.repeat(np.array(["x", "y", "z"]), n)
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.arange(1, 3 * n + 1), "t_s": 60.0 * np.arange(3 * n), "position": position,
        "run": np.ones(3 * n, dtype=np.int64), "table_rate_dps": rate, "temperature_c": warm, "n": np.full(3 * n, 300),
    }  # fmt: skip
    for axis in "xyz":
        columns[f"gyro_{axis}"] = np.where(position == axis, 1.01 * rate, 2e-3 * rate) + 0.2 + 1e-3 * warm
        columns[f"gyro_{axis}_std"] = np.full(3 * n, 2e-3 * np.sqrt(300))
    info = RecordingInfo(serial="B", axes=("x", "y", "z"), kind="points", started_at=datetime(2026, 1, 1, tzinfo=UTC))
    return fit_data_of(Recording(info, columns))


def _population() -> dict[str, float]:
    """Return the time of the population of all units, twelve coefficients, 200 batches and 5 benches."""
    rng = np.random.default_rng(3)
    names = tuple(f"{axis}.c{i}" for axis in "xyz" for i in range(4))
    values, covariance = rng.normal(size=(UNITS, 12)), 0.01 * np.eye(12)
    batch, bench = rng.integers(200, size=UNITS), rng.integers(5, size=UNITS)
    units = [
        UnitCoefficients(f"U{i}", names, values[i], covariance, {"batch": f"B{batch[i]}", "bench": f"b{bench[i]}"})
        for i in range(UNITS)
    ]
    return {"population_s": _cpu_s(lambda: population_of(units), 1)}


def _cpu_s(work: Callable[[], object], runs: int = 5) -> float:
    """Return the median processor time of `work`, s, over runs; where there are several, after one that is left out."""
    if runs > 1:
        work()
    times = []
    for _ in range(runs):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times)
