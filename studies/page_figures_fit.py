"""The figures of a fit beside those of another fit: coefficients, u, errors at temperatures left out, noise.

Each row is a kind of figure, as in `studies.page_figures_pages`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from studies.page_figures_formulas import white_std
from studies.page_figures_pages import SMALL_DIFFERENCE, Compared, Row, figure
from studies.page_figures_recomputed import stability_of, turning_size_of
from studies.page_figures_refit import Means, Refit, near_repeats

#: Of the standard uncertainty of a coefficient: the outputs differ by the rounding of the stored table rates.
SHARE_OF_U = 1e-3
#: Data sets without times are numbered by the fit without a temperature as if they followed each other.
TIMES_CLOSED_UP = 1e-4
#: Pairs differ by what the surface of the noise floor has between their rates and temperatures, which is left in here.
BESIDE_A_SURFACE = 5e-3


def fit_of_version(c: Compared) -> Iterator[Row]:
    """Yield coefficients and u of a version, its error at temperatures left out, and the noise of the means."""
    answer, sets = c.get(c.path), c.sets
    white = {axis: white_var(c, axis) for axis in c.law.axes}
    has_turning = "once_per_turn_dps" in answer["environment"]
    turning_var = turning_size_of(c.database, c.recording) ** 2 / 2 if has_turning else 0.0
    times, run = (
        sets.mean.get("t_s", np.arange(float(len(sets.number)))),
        np.round(sets.mean.get("run", 0.0 * sets.number)),
    )
    means = {
        axis: Means(times, run, sets.table_rate_dps, white[axis], stability_of(c.database, c.recording), turning_var)
        for axis in c.law.axes
    }
    refit = Refit.of(c.law, sets, means)
    for axis, (values, covariance) in refit.averaged.items():
        names = c.law.names[axis]
        u = np.sqrt(np.diag(covariance))[: len(names)]
        shown = [answer["axes"][axis]["coefficients"][name] for name in names]
        off = np.abs(np.array([each["value"] for each in shown]) - values[: len(names)]) / u
        yield Row("coefficients by a refit, of their u", float(off.max()), len(names), SHARE_OF_U)
        yield figure("u of coefficients by a refit, over another", [each["u"] for each in shown] / u, np.ones(len(u)),
                     SHARE_OF_U)  # fmt: skip
    yield from _left_out(c, refit)
    yield from _noise(c, white, refit)


def white_var(c: Compared, axis: str) -> np.ndarray | None:
    """Return the variance of each mean by the white noise of its readings, (n,); None: the readings are not known."""
    if not c.sets.raw:
        return None
    parts = np.split(c.sets.raw[f"gyro_{axis}"], c.sets.begins[1:-1])
    return np.array([white_std(part) for part in parts]) ** 2 / c.sets.readings


def _left_out(c: Compared, refit: Refit) -> Iterator[Row]:
    """Yield the RMS error at temperatures left out, wherever it is shown; unknown where a fit cannot do without one."""
    answer = c.get(c.path)["error"]["heldout_rms_dps"]
    (step,) = (each for each in c.get(f"/api/units/{c.serial}/ladder")["steps"] if each["version"] == c.version)
    shown = [answer, c.get(f"{c.path}/criticism")["error"]["heldout_rms_dps"], step["heldout_rms_dps"]]
    own = refit.rms_left_out()
    if own is None:
        assert shown == [None] * 3, f"RMS error at temperatures left out: {shown}, and no fit can do without one"
        return
    yield figure("RMS error at temperatures left out", shown, [own] * 3, TIMES_CLOSED_UP)


def _noise(c: Compared, white: dict[str, np.ndarray | None], refit: Refit) -> Iterator[Row]:
    """Yield the white noise of a mean, the noise floor with the drift that is stated, or that of near repeats."""
    criticism, answer = c.get(f"{c.path}/criticism"), c.get(c.path)
    error = criticism["error"]
    if error["noise_floor_source"] == "repeats":
        left = refit.left_dps
        scatter = [
            near_repeats(left[axis], c.sets.table_rate_dps, c.sets.temperature_c, c.sets.position) for axis in left
        ]
        yield figure("noise floor by near repeats", [error["noise_floor_dps"]], scatter, BESIDE_A_SURFACE)
        return
    own = {axis: np.sqrt(np.mean(each)) for axis, each in white.items() if each is not None}
    noise = answer["noise"]
    yield figure("white noise of a mean", [noise[axis]["white_dps"] for axis in own], list(own.values()),
                 SMALL_DIFFERENCE)  # fmt: skip
    floors = [
        each + noise[axis]["drift_dps"] ** 2 + (noise[axis]["per_rate"] * c.sets.table_rate_dps) ** 2
        for axis, each in white.items() if each is not None
    ]  # fmt: skip
    yield figure("noise floor, with the drift that is stated", [error["noise_floor_dps"]],
                 [np.sqrt(np.mean(floors))], SMALL_DIFFERENCE)  # fmt: skip
