"""Three triads by hand: coverage of U, of accelerometer and magnetometer and of the alignments, at 12 to 100 rests.

U = t(95.45 %, nu) u. Then over temperature, and with an earlier version of the accelerometer. `run()` gives each share
with its standard uncertainty; truth is `studies.triads_simulation`, of NumPy alone.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from labctl.fitting.magnetometer.alignment import align_field
from labctl.fitting.magnetometer.calibrate import calibrate_magnetometer
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, calibrate_accelerometer
from labctl.fitting.poses.at_rest.fewer_poses import Known, Scatter, by_fewer_poses
from labctl.fitting.poses.at_rest.rests import Rests, find_rests, rest_of_each
from labctl.fitting.poses.at_rest.temperature import calibrate_over_temperature
from labctl.fitting.poses.fit import Solved, solve
from labctl.fitting.poses.readings import AXES, PoseReadings, readings_of
from labctl.fitting.poses.triad import UPPER
from labctl.recording import Recording, RecordingInfo
from labctl.services.pose_triads import solve_even
from studies.poses import turned_deg
from studies.triads_simulation import DIP_DEG, TrueTriads, Warming, turned_by_hand, vector_of, warmed_k

#: Rests of a session, and sessions.
CELLS = {12: 300, 22: 200, 30: 200, 100: 60}
#: Sessions over temperature, and with an earlier version.
OTHERS = 60
#: Middle of the temperatures, deg C, and what a scale factor and a misalignment change from session to session.
ABOUT_C, CHANGES = 25.0, (1e-3, 5e-4)
#: Field that is another in each rest, uT, and how many readings one of the magnetometer's is taken from.
PLACE_UT, EVERY = 0.2, 10


def recording_of(t_s: np.ndarray, gyro_dps: np.ndarray, force_g: np.ndarray, field_ut: np.ndarray) -> Recording:
    """Return a recording in poses of time (n,) and readings (n, 3)."""
    info = RecordingInfo(
        serial="TRIADS-1", axes=AXES, kind="samples", motion="poses", started_at=datetime(2026, 1, 5, tzinfo=UTC)
    )
    columns: dict[str, np.ndarray] = {"dataset": np.ones(len(t_s), dtype=np.int64), "t_s": t_s}
    for i, axis in enumerate(AXES):
        columns |= {
            f"accel_{axis}_g": force_g[:, i], f"gyro_{axis}": gyro_dps[:, i], f"field_{axis}_ut": field_ut[:, i]
        }  # fmt: skip
    return Recording(info, columns)


#: Kind -> (value - truth) / U of each of its numbers; `field u` is the magnetometer's angles' u, deg.
Scores = dict[str, np.ndarray]
Parts = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def scores(seed: int, rests: int, place_ut: float = PLACE_UT) -> Scores:
    """Return (value - truth) / U of a session, kind by kind."""
    unit = TrueTriads.drawn(np.random.default_rng(10**6 + seed))
    parts = turned_by_hand(seed, unit, rests, place_ut=place_ut)
    readings = readings_of(recording_of(*parts))
    return _scores(unit, readings, solve(readings), parts)


def scores_over_temperature(seed: int, rests: int) -> Scores:
    """Return the same of a session at four temperatures, over which bias and scale factors of the forces change.

    The truth is that of the temperature to which the calibration refers.
    """
    rng = np.random.default_rng(2 * 10**6 + seed)
    unit = TrueTriads.drawn(np.random.default_rng(10**6 + seed))
    parts = turned_by_hand(seed, unit, rests, place_ut=PLACE_UT)
    away_k = warmed_k(len(parts[0]))
    warming = Warming.drawn(rng)
    changed = (parts[0], parts[1], warming.readings(unit, parts[2], away_k), parts[3])
    readings = replace(readings_of(recording_of(*changed)), temperature_c=ABOUT_C + away_k)
    rests_found = find_rests(readings)
    found = calibrate_over_temperature(readings, rests_found)
    at_reference = warming.unit_at(unit, found.reference_c - ABOUT_C)
    return _scores(at_reference, readings, solve_even(readings, rests_found, found), changed)


def scores_with_earlier(seed: int, rests: int) -> Scores:
    """Return the same with an earlier session's accelerometer, which has changed since as the fit allows."""
    rng = np.random.default_rng(3 * 10**6 + seed)
    unit = TrueTriads.drawn(np.random.default_rng(10**6 + seed))
    first = readings_of(recording_of(*turned_by_hand(seed, unit, 24, place_ut=PLACE_UT)))
    rests_then = find_rests(first)
    was = calibrate_accelerometer(first, rests_then)
    changes = np.where(np.eye(3, dtype=bool), *CHANGES)
    moved = unit.force + np.triu(rng.normal(0, 1, (3, 3)) * changes)
    now = replace(unit, force=moved, force_bias_g=unit.force_bias_g + rng.normal(0, 0.01, 3))
    parts = turned_by_hand(10**5 + seed, now, rests, place_ut=PLACE_UT)
    readings = readings_of(recording_of(*parts))
    found = find_rests(readings)
    of_change = np.diag(np.repeat(CHANGES, 3) ** 2)
    errors = np.array([was.errors[place] for place in UPPER])
    known = Known(errors, was.covariance[3:, 3:] + of_change, was.bias_g, scatter_then(was, rests_then))
    fewer = by_fewer_poses(readings, found, known)
    return _scores(now, readings, solve(readings, (found, fewer.accelerometer)), parts)


def scatter_then(was: Accelerometer, rests: Rests) -> Scatter:
    """Return how the sizes scattered in the rests of an earlier session."""
    used = int(np.count_nonzero(was.used))
    noise = float(rests.accel_white_var[was.used].mean())
    return Scatter(was.residual_g**2 * used / was.freedom, noise, was.freedom)


def _scores(unit: TrueTriads, readings: PoseReadings, solved: Solved, parts: Parts) -> Scores:
    gyro, force = solved.alignment, solved.accelerometer
    rest = rest_of_each(solved.rests, len(readings), readings.spacing_s)
    iron = calibrate_magnetometer("study", parts[3][::EVERY], rest=rest[::EVERY])
    field = align_field(readings, solved, parts[3], iron)
    true = np.radians(turned_deg(unit.gyro - np.eye(3), unit.force - np.eye(3)))
    away = (
        np.append(field.angles_rad - vector_of(unit.turned), field.dip_rad - np.radians(DIP_DEG)) / field.expanded_rad
    )
    of_force = np.concatenate([
        force.bias_g - unit.force_bias_g, [(force.errors - unit.force + np.eye(3))[place] for place in UPPER]
    ]) / force.expanded  # fmt: skip
    soft = np.linalg.inv(unit.field @ unit.turned)
    soft /= np.cbrt(np.linalg.det(soft))
    of_iron = np.concatenate([
        iron.hard_iron_ut - unit.hard_iron_ut, [(iron.soft_iron - soft)[place] for place in PLACES]
    ]) / iron.expanded[:9]  # fmt: skip
    return {
        "gyro": (gyro.angles_rad - true) / gyro.expanded_rad, "magnetometer": away[:3], "dip": away[3:],
        "bias": of_force[:3], "scale factor": of_force[3:6], "misalignment": of_force[6:],
        "hard iron": of_iron[:3], "soft iron": of_iron[3:], "field u": np.degrees(field.u_rad[:3]),
    }  # fmt: skip


def run(cells: dict[int, int] | None = None, others: int = OTHERS) -> str:
    """Return the table: by rests, the share of each kind within U, and the root mean square of error over U.

    `others` are the sessions over temperature, and those with an earlier version.
    """
    rows = []
    for rests, sessions in (cells or CELLS).items():
        rows += _rows(f"{rests} rests", [scores(k, rests) for k in range(sessions)])
    if others:
        rows += _rows("32 rests over temperature", [scores_over_temperature(k, 32) for k in range(others)])
        rows += _rows("12 rests with an earlier version", [scores_with_earlier(k, 12) for k in range(others)])
    return "\n".join(rows)


def _rows(name: str, found: list[Scores]) -> list[str]:
    kinds = {kind: np.array([each[kind] for each in found]) for kind in found[0]}
    rows = [f"   {name}, {len(found)} sessions, field u {np.median(kinds.pop('field u')):.3f} deg:"]
    for kind, z in kinds.items():
        within = np.abs(z) <= 1
        spread = within.mean(axis=1).std() / np.sqrt(len(z))
        rows.append(
            f"      {kind:13} {100 * within.mean():5.1f} % +- {100 * spread:.1f}; RMS {np.sqrt(np.mean(z**2)):.2f} U"
        )
    return rows
