"""`Compensator.compensate` of an array by models with heat flows, evenly sampled at 100 Hz and unevenly, on one core.

The model without state is the one of the same bias over temperature; all are one axis but the last, which has three
axes with a time constant each. Processor time, so that other work on the computer does not count.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np

from benchmarks.machine import describe
from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.fitting.effects import Term
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array

N, RUNS = 2_000_000, 5
BIAS = (Term("bias"), Term("bias_temperature", 2))
SHAPES: dict[str, tuple[str, dict[str, float]]] = {
    "one_flow": ("z", {"tau_s": 400.0}),
    "two_flows": ("z", {"tau_s": 60.0, "second_tau_s": 1500.0}),
    "two_ways": ("z", {"tau_s": 300.0, "cooling_tau_s": 700.0}),
    "three_axes": ("xyz", {"tau_x_s": 300.0, "tau_y_s": 480.0, "tau_z_s": 390.0}),
}


def _compensator(axes: str, parameters: dict[str, float] | None) -> Compensator:
    lag = () if parameters is None else (Term("thermal_lag", None, parameters),)
    names = ["bias", "bias_t1", "bias_t2", *(["thermal_lag"] if lag else [])]
    names += ["thermal_lag_second"] if parameters and "second_tau_s" in parameters else []
    owners = ["bias", "bias_temperature", "bias_temperature", *["thermal_lag"] * (len(names) - 3)]
    fit = AxisFit(
        tuple(owners), tuple(names), ("",) * len(names), np.full((len(names), 1), 1e-3), np.zeros((len(names),) * 2)
    )
    fitted = FittedModel(ErrorModel("bench", (*BIAS, *lag)), dict.fromkeys(axes, fit))
    document: dict[str, Any] = {
        "serial": "BENCH", "version": 1, "axes": list(axes), "output": {axis: {"unit": "deg/s"} for axis in axes},
        "model": fitted.to_dict(), "validity": {"temperature_c": [-30.0, 70.0], "rate_dps": [-100.0, 100.0]},
    }  # fmt: skip
    return Compensator(Calibration(document))  # type: ignore[arg-type]


def _million_per_s(compensator: Compensator, t_s: Array, warm: Array) -> float:
    raw = np.random.default_rng(1).normal(size=(N, len(compensator.axes)))
    used = []
    for _ in range(RUNS):
        start = time.process_time()
        compensator.compensate(raw, warm, {"t_s": t_s})
        used.append(time.process_time() - start)
    return N / statistics.median(used) / 1e6


def run() -> dict[str, float | str]:
    """Return million samples per second of each model."""
    rng = np.random.default_rng(2)
    even = 0.01 * np.arange(N)
    uneven = np.sort(rng.uniform(0.0, 0.01 * N, N))
    found: dict[str, float | str] = dict(describe("numpy", "scipy"))
    for label, t_s in (("even", even), ("uneven", uneven)):
        warm = 20.0 + 40.0 * np.sin(t_s / 1800.0) + 0.02 * rng.normal(size=N)
        found[f"no_state_{label}_million_per_s"] = _million_per_s(_compensator("z", None), t_s, warm)
        for name, (axes, parameters) in SHAPES.items():
            found[f"{name}_{label}_million_per_s"] = _million_per_s(_compensator(axes, parameters), t_s, warm)
    return found
