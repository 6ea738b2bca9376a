"""Alignment of the gyro and magnetometer triads to the accelerometer's: coverage of U = 2 u at 12, 30 and 100 rests.

`run()` gives each share with its standard uncertainty; truth is `studies.triads_simulation`, of NumPy alone.
"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from labctl.fitting.magnetometer.alignment import align_field
from labctl.fitting.magnetometer.calibrate import calibrate_magnetometer
from labctl.fitting.poses.fit import solve
from labctl.fitting.poses.readings import AXES, readings_of
from labctl.recording import Recording, RecordingInfo
from studies.poses import turned_deg
from studies.triads_simulation import DIP_DEG, TrueTriads, turned_by_hand, vector_of

#: Rests of a session, and sessions.
CELLS = {12: 100, 30: 80, 100: 20}
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


def scores(seed: int, rests: int, place_ut: float = PLACE_UT) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (value - truth) / u of the gyro's angles (3,), and of the magnetometer's with the dip (4,); its u, deg."""
    unit = TrueTriads.drawn(np.random.default_rng(10**6 + seed))
    parts = turned_by_hand(seed, unit, rests, place_ut=place_ut)
    readings = readings_of(recording_of(*parts))
    solved = solve(readings)
    gyro = solved.alignment
    field = align_field(readings, solved, parts[3], calibrate_magnetometer("study", parts[3][::EVERY]))
    true = np.radians(turned_deg(unit.gyro - np.eye(3), unit.force - np.eye(3)))
    away = np.append(field.angles_rad - vector_of(unit.turned), field.dip_rad - np.radians(DIP_DEG))
    return (gyro.angles_rad - true) / gyro.u_rad, away / field.u_rad, np.degrees(field.u_rad)


def run(cells: dict[int, int] | None = None) -> str:
    """Return the table: by rests, the share of each kind within 2 u, and the root mean square of error over u."""
    rows = []
    for rests, sessions in (cells or CELLS).items():
        gyro, field, u = (np.array(each) for each in zip(*(scores(k, rests) for k in range(sessions)), strict=True))
        rows.append(f"   {rests} rests, {sessions} sessions, field u {np.median(u[:, :3]):.3f} deg:")
        for kind, z in (("gyro", gyro), ("magnetometer", field[:, :3]), ("dip", field[:, 3:])):
            share = float(np.mean(np.abs(z) <= 2))
            spread = np.mean(np.abs(z) <= 2, axis=1).std() / np.sqrt(len(z))
            size = np.sqrt(np.mean(z**2))
            rows.append(f"      {kind:13} {100 * share:5.1f} % +- {100 * spread:.1f}; RMS {size:.2f} u")
    return "\n".join(rows)
