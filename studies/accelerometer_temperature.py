"""Accelerometers over temperature: coverage of U = 2 u over simulated units with known truth, and the verdict.

`run()` gives each figure with the number of coefficients behind it; the units are those of
`studies.accelerometer_simulation`, which shares no formula with the fit.
"""

from __future__ import annotations

import math
from collections import defaultdict
from math import comb

import numpy as np

from labctl.fitting.poses.at_rest.rests import find_rests
from labctl.fitting.poses.at_rest.temperature import OverTemperature, calibrate_over_temperature
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import UPPER
from labctl.recording import RecordingInfo
from labctl.recording.info import NO_DATE
from studies.accelerometer_simulation import TrueUnit, poses_at_temperatures

UNITS = 200
#: Error of a rest beyond the noise of its mean, g: none, and one that the verdict has to find.
CELLS = {"noise alone": 0.0, "0.5 mg more in each rest": 5e-4}


def run(units: int = UNITS) -> str:
    """Return the table: coverage of U = 2 u by cell and kind of coefficient, and how many verdicts are adequate."""
    return "\n".join(row for name, pose_g in CELLS.items() for row in _cell(name, pose_g, units))


def _cell(name: str, pose_g: float, units: int) -> list[str]:
    scores: dict[str, list[float]] = defaultdict(list)
    adequate = 0
    for seed in range(units):
        unit = TrueUnit.drawn(np.random.default_rng([seed, 1]))
        found = calibrated(poses_at_temperatures(seed, unit, pose_g=pose_g))
        adequate += found.adequacy.verdict == "adequate"
        for kind, values in scores_of(found, unit).items():
            scores[kind] += values
    rows = [f"   {name}, {units} units, {adequate} adequate:"]
    for kind, values in scores.items():
        z = np.abs(values)
        share = float(np.mean(z <= 2))
        u = math.sqrt(share * (1 - share) / len(z))
        rows.append(f"      {kind:20} {100 * share:5.1f} % +- {100 * u:.1f} of {len(z)}; largest {z.max():.1f} u")
    return rows


def calibrated(table: np.ndarray) -> OverTemperature:
    """Return the calibration by a table of time, s, readings, g, and temperature, deg C, (n, 5)."""
    info = RecordingInfo.model_construct(
        serial="SIM", axes=AXES, kind="samples", motion="poses", started_at=NO_DATE, latitude_deg=None
    )
    n = len(table)
    readings = PoseReadings(
        info, table[:, 0], table[:, 1:4], np.zeros((n, 3)), table[:, 4], np.zeros(n, dtype=np.bool_)
    )
    return calibrate_over_temperature(readings, find_rests(readings))


def scores_of(found: OverTemperature, unit: TrueUnit) -> dict[str, list[float]]:
    """Return (value - truth) / u of every coefficient, by its kind."""
    away = found.reference_c - unit.about_c
    given = np.vstack([unit.bias_g, unit.bias_powers])
    about = [sum(comb(k, j) * away ** (k - j) * given[k] for k in range(j, len(given))) for j in range(len(given))]
    errors = unit.errors + np.diag(away * unit.scale_powers[0])
    values = [found.reference.bias_g, [found.reference.errors[place] for place in UPPER]]
    truths = [about[0], [errors[place] for place in UPPER]]
    values += [*found.bias_g, found.scale_factor[0]]
    truths += [*about[1:], unit.scale_powers[0]]
    z = (np.concatenate(values) - np.concatenate(truths)) / np.sqrt(np.diag(found.covariance))
    kinds = ["bias"] * 3 + ["scale factor"] * 3 + ["misalignment"] * 3
    kinds += [f"bias, power {k}" for k in (1, 2, 3) for _ in AXES] + ["scale factor, power 1"] * 3
    scores: dict[str, list[float]] = defaultdict(list)
    for kind, each in zip(kinds, z.tolist(), strict=True):
        scores[kind].append(each)
    return scores
