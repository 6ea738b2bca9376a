"""Logs at rest: what PX4's and ArduPilot's published thermal corrections leave on a leg that they were not fitted to.

Their formulas are written here from their public descriptions, without labctl:

- PX4 (`Tools/process_sensor_caldata.py`): the gyro's samples through a running median of 31, their means in 2000 bins
  of equal width in temperature, a least-squares cubic through the means in temperature minus the middle of the range,
  which its firmware takes off the output.
- ArduPilot (`Tools/scripts/tempcal_IMU.py`): samples and temperatures in a moving average of 2 s, a least-squares cubic
  (as many coefficients as its firmware has, INS_TCALn_GYR1 to 3) in temperature minus 35 deg C; its constant is the
  offset that the firmware learns at rest, here that of the fit, which is to its favour.

Both formulas give what the programs' own functions give on the same samples, to 1e-11 deg/s (PX4-Autopilot at 00f5c31,
ArduPilot's MethodicConfigurator at 436a9dd, which carries the script).

Each is fitted to one leg and tested on the other, both ways, in means of a minute, as labctl's figure is: with its
parabola, and with what its criticism names. The second table is a real warm-up (one leg: no other to be tested on), for
which its author printed the least-squares parabolas in the thermometer's raw words; labctl's must be the same.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.signal import medfilt

from labctl.fitting.criticism import criticise
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.temperature.legs import legs_of
from labctl.fitting.effects import CATALOGUE
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset, changed, preset_for
from labctl.recording import Recording, to_points
from studies.real.independent.files import columns_of
from studies.real.published import FREEIMU_WORDS
from studies.rest_loops import cells
from studies.rest_units import RATE_HZ, unit_at_rest

Array = NDArray[np.float64]
Law = Callable[[Array], Array]
CAMPAIGNS = int(os.environ.get("LABCTL_REST_CAMPAIGNS", "100"))
REFERENCE_C, AVERAGED_S = 35.0, 2
#: PX4's running median, in samples, and its bins in temperature.
MEDIAN_OF, BINS = 31, 2000
#: The thermometer of the MPU-6050: deg C = word / 340 + 36.53.
WORDS_PER_K, ZERO_C = 340.0, 36.53


def px4(warm: Array, rate: Array) -> Law:
    """Return PX4's correction of samples (n,) at temperatures (n,): a cubic about the middle of the range."""
    middle = (float(warm.max()) + float(warm.min())) / 2
    above = (warm - middle) - float((warm - middle).min())
    bins = np.minimum((above / (above.max() / BINS)).astype(np.int64), BINS - 1)
    count = np.bincount(bins, minlength=BINS)
    sums = (np.bincount(bins, weights=values, minlength=BINS) for values in (warm, medfilt(rate, MEDIAN_OF)))
    mean_c, mean = (values[count > 0] / count[count > 0] for values in sums)
    coefficients = np.polyfit(mean_c - middle, mean, 3)
    return lambda there: np.polyval(coefficients, there - middle)


def ardupilot(warm: Array, rate: Array, rate_hz: float = RATE_HZ) -> Law:
    """Return ArduPilot's correction: a cubic about 35 deg C through moving averages of 2 s."""
    width = max(int(rate_hz) * AVERAGED_S, 1)
    kernel = np.full(width, 1.0 / width)
    mean_c, mean = (np.convolve(values, kernel, mode="valid") for values in (warm, rate))
    coefficients = np.polyfit(mean_c - REFERENCE_C, mean, 3)
    return lambda there: np.polyval(coefficients, there - REFERENCE_C)


def across_legs(recording: Recording) -> dict[str, float]:
    """Return method -> root mean square of the minutes of each leg by a fit to the other legs, deg/s."""
    points = to_points(recording)
    data = fit_data_of(points)
    legs = legs_of(data.temperature_c, np.ones(len(data), dtype=np.int64))
    readings_s, warm, rate = (
        np.asarray(recording.columns[name], dtype=np.float64) for name in ("t_s", "temperature_c", "gyro_z")
    )
    nearest = np.clip(np.searchsorted(np.asarray(points.columns["t_s"]) + 30.0, readings_s), 0, len(data) - 1)
    found: dict[str, list[Array]] = {}
    base = preset_for("bias_temperature", [])
    verdict = criticise(recording, fit_preset(data, base).fitted.model, CATALOGUE, points=points, full=False).verdict
    named = tuple(verdict.terms[group[0]] for group in verdict.groups if group[0] in verdict.terms)
    better = with_shapes(data, changed(base.build(data)[0], named), all_of_them=True)
    numbers = [int(number) for number in np.unique(legs) if number]
    for left in numbers:
        tested, seen = legs == left, (legs != left) & (legs != 0)
        for name, method in (("PX4", px4), ("ArduPilot", ardupilot)):
            law = method(warm[seen[nearest]], rate[seen[nearest]])
            found.setdefault(name, []).append(data.outputs["z"][tested] - law(data.temperature_c[tested]))
        for name, preset in (("labctl, parabola", base), ("labctl, improved", better)):
            found.setdefault(name, []).append(_left(data, preset, seen, tested))
    return {name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in found.items()}


def _left(data: FitData, preset: Preset, seen: NDArray[np.bool_], tested: NDArray[np.bool_]) -> Array:
    part = data.take(seen)
    model, _ = preset.build(part)
    whole = solve_axes(data, preset.build(data)[0])
    solved = solve_axes(part, model, whole.noise)
    return residuals(FittedModel(model, solved.fits), data.take(tested), solved.nuisance)["z"]


def lines() -> Iterator[str]:
    """Yield the table of simulated loops, row by row: medians, and ratios to PX4."""
    yield f"   every leg by a fit to the others, two loops, n = {CAMPAIGNS} a cell, median, 1e-3 deg/s"
    for cell, (hidden, _) in cells().items():
        found = [across_legs(unit_at_rest(seed, hidden)) for seed in range(CAMPAIGNS)]
        medians = {name: float(np.median([one[name] for one in found])) for name in found[0]}
        shown = ", ".join(f"{name} {1e3 * value:.3f}" for name, value in medians.items())
        ratio = medians["labctl, improved"] / min(medians["PX4"], medians["ArduPilot"])
        yield f"   {cell:18} {shown}; improved over the better peer {ratio:.3f}"


def printed_parabolas() -> dict[str, tuple[Array, Array]]:
    """Return axis -> labctl's coefficients of the published warm-up in its author's units, and those printed.

    labctl's design and solver on every reading, unweighted as the author's: square, linear, constant term in words.
    """
    from labctl.fitting.numeric.drift_noise import Drift, Scatter
    from labctl.fitting.numeric.least_squares import solve

    columns = columns_of("freeimu-warmup.parquet")
    word = np.asarray(columns["dTemp"], dtype=np.float64)
    n = len(word)
    scatter = Scatter(np.arange(float(n)), np.ones(n, dtype=np.int64), np.zeros(n), np.ones(n))
    found = {}
    warm = word / WORDS_PER_K + ZERO_C
    centre = float(np.round((warm.min() + warm.max()) / 2))
    design = np.column_stack([np.ones(n), warm - centre, (warm - centre) ** 2])
    for axis in "xyz":
        b, b1, b2 = solve(design, np.asarray(columns[f"G{axis}"], dtype=np.float64), scatter, Drift(0.0, 1.0)).values
        offset = ZERO_C - centre
        ours = (b2 / WORDS_PER_K**2, (b1 + 2 * b2 * offset) / WORDS_PER_K, b + b1 * offset + b2 * offset**2)
        found[axis] = np.array(ours), np.array(FREEIMU_WORDS[axis])
    return found


def run() -> str:
    """Return the tables: simulated loops, and the published warm-up."""
    found = list(lines())
    for axis, (ours, theirs) in printed_parabolas().items():
        worst = float(np.max(np.abs(ours / theirs - 1)))
        found.append(f"   warm-up, axis {axis}: labctl {ours}, printed {theirs}, apart by {worst:.1e} at most")
    return "\n".join(found)


if __name__ == "__main__":
    print(run())
