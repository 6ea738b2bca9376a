"""Several recordings of one unit fitted together: coverage of the coefficients, false alarms, and what is named.

Every pair is a unit measured on two days with its own drift, white noise, and shifts of bias and scale factor drawn
anew for each day. The recordings are made here by plain formulas, which share nothing with the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import partial

import numpy as np
from numpy.typing import NDArray

from labctl.fitting import fit
from labctl.fitting.criticism import criticise
from labctl.fitting.data.joined import joined_recording
from labctl.recording import Recording, RecordingInfo

PAIRS = 200
CRITICISED = 40
STARTED = datetime(2026, 1, 5, 8, tzinfo=UTC)
TEMPERATURES_C = (-20.0, 0.0, 25.0, 45.0, 60.0)
RATES_DPS = (-200.0, -100.0, -50.0, -10.0, 0.0, 10.0, 50.0, 100.0, 200.0)
TRUTH = {"bias": 0.05, "bias_t1": 1e-4, "bias_t2": 2e-6, "scale_factor": 2e-3, "scale_factor_t1": 1e-5}
EFFECTS = ["bias", "bias_temperature:2", "scale_factor", "scale_factor_temperature:1"]
WHITE_DPS, DRIFT_DPS, TAU_S, READINGS = 2e-4, 3e-4, 1500.0, 3000
#: Standard deviations of the shifts of bias, deg/s, and of scale factor, by name of the cell.
SHIFTS = {"none": (0.0, 0.0), "as the noise": (3e-4, 3e-6), "large": (1e-2, 1e-4)}


@dataclass(frozen=True)
class Found:
    """What one joint fit said: errors over their uncertainty, and whether each kind of shift was seen and covered."""

    z: Sequence[float]
    seen: Sequence[bool]
    covered: Sequence[bool]
    disagree: int
    verdict: str = ""
    named: Sequence[str] = field(default_factory=list)


def made(rng: np.random.Generator, day: int, bias_dps: float, scale: float, quadratic: float = 0.0) -> Recording:
    """Return the means of one day, with shifts of bias and scale factor and an error quadratic in the rate."""
    n = len(TEMPERATURES_C) * len(RATES_DPS)
    warm = np.repeat(TEMPERATURES_C, len(RATES_DPS)) + rng.normal(0, 0.05, n)
    rate = np.tile(RATES_DPS, len(TEMPERATURES_C))
    t_s = 75.0 * np.arange(n) + np.repeat(np.arange(len(TEMPERATURES_C)), len(RATES_DPS)) * 3600.0
    drift: NDArray[np.float64] = np.zeros(n)
    drift[0] = rng.normal(0, DRIFT_DPS)
    for i, keep in enumerate(np.exp(-np.diff(t_s) / TAU_S), start=1):
        drift[i] = keep * drift[i - 1] + DRIFT_DPS * np.sqrt(1 - keep**2) * rng.normal()
    above = warm - 20.0
    error = TRUTH["bias"] + bias_dps + TRUTH["bias_t1"] * above + TRUTH["bias_t2"] * above**2
    error += rate * (TRUTH["scale_factor"] + scale + TRUTH["scale_factor_t1"] * above) + quadratic * rate**2
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": t_s, "table_rate_dps": rate, "temperature_c": warm,
        "gyro_z": rate + error + drift + rng.normal(0, WHITE_DPS, n),
        "gyro_z_std": np.full(n, WHITE_DPS * np.sqrt(READINGS)), "n": np.full(n, READINGS),
        "duration_s": np.full(n, 60.0),
    }  # fmt: skip
    info = RecordingInfo(
        serial="J", axes=("z",), kind="points", started_at=STARTED + timedelta(days=day), technology="mems",
        datasheet={"bias_stability_dps": DRIFT_DPS},
    )  # fmt: skip
    return Recording(info, columns)


def unit(seed: int, cell: str, days: int, quadratic: float = 0.0) -> Recording:
    """Return the recordings of a unit on so many days, ten days apart, as one."""
    rng = np.random.default_rng([seed, days, list(SHIFTS).index(cell)])
    turn_on, per_day = SHIFTS[cell]
    parts = [made(rng, 10 * day, rng.normal(0, turn_on), rng.normal(0, per_day), quadratic) for day in range(days)]
    return joined_recording(dict(enumerate(parts, start=1)))


def scores(cell: str, days: int, seed: int) -> Found:
    """Return how far the coefficients of one unit are from the truth, and what was said of its shifts."""
    result = fit(unit(seed, cell, days), None, EFFECTS)
    axis = result.fitted.axes["z"]
    z = [(values[0] - TRUTH[name]) / u[0] for name, values, u in zip(axis.names, axis.values, axis.u, strict=True)]
    assert result.joint is not None
    lines = result.joint["repeatability"]["z"]
    covered = [line["low"] <= size <= line["high"] for line, size in zip(lines, SHIFTS[cell], strict=True)]
    disagree = sum(not each["agree"] for each in result.joint["agreement"])
    return Found(z, [line["seen"] for line in lines], covered, disagree)


def verdict(days: int, quadratic: float, seed: int) -> str:
    """Return the verdict on several days of one unit with large shifts, and what it names."""
    whole = unit(1000 + seed, "large", days, quadratic)
    found = criticise(whole, fit(whole, None, EFFECTS).fitted.model, full=False).verdict
    return (
        found.form if found.form in {"adequate", "insufficient_data"} else f"{found.form}: {' or '.join(found.named)}"
    )


def run(pairs: int = PAIRS, criticised: int = CRITICISED, workers: int = 2) -> str:
    """Return coverage and false alarms in words."""
    lines = []
    with ProcessPoolExecutor(max_workers=workers) as pool:
        for cell in SHIFTS:
            for days in (2, 3):
                found = list(pool.map(partial(scores, cell, days), range(pairs), chunksize=5))
                lines.append(_of_cell(cell, days, found))
        for days in (2, 3):
            for quadratic in (0.0, 3e-8):
                said = list(pool.map(partial(verdict, days, quadratic), range(criticised)))
                counts = {form: said.count(form) for form in sorted(set(said))}
                hidden = f"{quadratic:g} deg/s per (deg/s)^2 hidden" if quadratic else "nothing hidden"
                lines.append(f"{days} recordings, {hidden}, {criticised} units: {counts}")
    return "\n".join(lines)


def _of_cell(cell: str, days: int, found: Sequence[Found]) -> str:
    z = np.abs(np.array([each.z for each in found]))
    inside = ", ".join(f"{name} {100 * share:.1f}" for name, share in zip(TRUTH, np.mean(z < 2, axis=0), strict=True))
    seen = np.mean([each.seen for each in found], axis=0)
    covered = np.mean([each.covered for each in found], axis=0)
    apart = np.mean([each.disagree > 0 for each in found])
    return (
        f"{days} recordings, shifts {cell}, {len(found)} units: % within U(k=2): {inside}; "
        f"all {100 * np.mean(z < 2):.1f}; shift of bias seen {100 * seen[0]:.1f} %, of scale factor "
        f"{100 * seen[1]:.1f} %; standard deviation inside its 95 %: {100 * covered[0]:.1f} % and "
        f"{100 * covered[1]:.1f} %; a disagreement in {100 * apart:.1f} %"
    )


if __name__ == "__main__":
    print(run())
