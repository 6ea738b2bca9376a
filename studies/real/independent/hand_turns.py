"""Ferraris' method on imucal's two sessions: six rests and one turn by 360 deg about each axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studies.real.independent.files import AXES, Array, Found, Value, columns_of, numbers

TURN_DEG, TURN_U_DEG = 360.0, 1.0
#: Part of a session -> output in deg/s (n, 3) and specific force in any unit (n, 3).
Parts = dict[str, tuple[Array, Array]]
#: The annotated session: readings per second, and nominal words per deg/s.
ANNOTATED_HZ, WORDS_PER_DPS = 204.8, 16.4
#: The other one, whose rows, from 0, of each part its authors list: first, and the one after the last.
SESSION_HZ = 102.4
SESSION_ROWS = {
    "x_p": (540, 1271), "x_a": (1620, 2361), "y_p": (2814, 3298), "y_a": (3740, 4152), "z_p": (4522, 4975),
    "z_a": (5376, 5983), "x_rot": (6770, 7093), "y_rot": (8081, 8405), "z_rot": (9205, 9512),
}  # fmt: skip


def annotated() -> Parts:
    """Return the session whose parts a column names, in words."""
    gyro, force, columns = _readings("imucal-annotated.parquet")
    part = np.asarray(columns["part"]).astype(str)
    return {name: (gyro[part == name] / WORDS_PER_DPS, force[part == name]) for name in dict.fromkeys(part.tolist())}


def session() -> Parts:
    """Return the session whose parts are listed beside it."""
    gyro, force, _ = _readings("imucal-session.parquet")
    return {name: (gyro[a:b], force[a:b]) for name, (a, b) in SESSION_ROWS.items()}


def _readings(name: str) -> tuple[Array, Array, dict[str, NDArray[np.generic]]]:
    columns = columns_of(name)
    gyro, force = (numbers(columns, *(f"{kind}_{axis}" for axis in AXES)) for kind in ("gyr", "acc"))
    return gyro, force, columns


def per_g(found: Parts) -> tuple[Array, Array]:
    """Return the bias (3,) and its change by g along each axis (3, 3), rows outputs, from the six rests."""
    up = np.array([found[f"{axis}_p"][0].mean(axis=0) for axis in AXES])
    down = np.array([found[f"{axis}_a"][0].mean(axis=0) for axis in AXES])
    return (up + down).mean(axis=0) / 2, (up - down).T / 2


def analysis(found: Parts, rate_hz: float) -> Found:
    """Return the matrix E of output = bias + (1 + E) rate, in 1e-3, and the bias in deg/s.

    A turn gives a column: (integral of the output - what rests would have given) / angle. Its uncertainty: the angle's
    share, in proportion to the element; the white noise of the turn; and that of the rests, times the turn's length.
    The bias scatters from rest to rest.
    """
    bias, change = per_g(found)
    rests = [values for name, (values, _) in found.items() if not name.endswith("_rot")]
    noise = np.sqrt(np.mean([values.var(axis=0, ddof=1) for values in rests], axis=0))
    u_rest = np.std([values.mean(axis=0) for values in rests], axis=0, ddof=1) / np.sqrt(len(rests))
    answer: Found = {}
    for column, about in enumerate(AXES):
        rates, force = found[f"{about}_rot"]
        g = force.mean(axis=0) / np.linalg.norm(force.mean(axis=0))  # along the axis of the turn, up or down
        time_s = len(rates) / rate_hz
        way = np.sign(rates[:, column].sum())  # the sense of the turns is not published
        gain = (rates.sum(axis=0) / rate_hz - (bias + change @ g) * time_s) / (way * TURN_DEG)
        u_noise = np.hypot(noise * np.sqrt(len(rates)) / rate_hz, u_rest * time_s) / TURN_DEG
        u = np.hypot(u_noise, gain * TURN_U_DEG / TURN_DEG)
        for row, axis in enumerate(AXES):
            own = 1.0 if row == column else 0.0
            answer[f"{axis} by rate about {about}, E, 1e-3"] = Value(1e3 * float(gain[row] - own), 1e3 * float(u[row]))
    for row, axis in enumerate(AXES):
        answer[f"{axis}: bias, deg/s"] = Value(float(bias[row]), float(u_rest[row]))
    return answer


SESSIONS = {"imucal-annotated": (annotated, ANNOTATED_HZ), "imucal-session": (session, SESSION_HZ)}
