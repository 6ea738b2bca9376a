"""Calibration by hand: coverage of U = 2 u over simulated sessions with known truth, and held-out moves.

`run()` gives each figure with the number of coefficients behind it; truth is `studies.poses_simulation`, which shares
no formula with the fit.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from labctl.fitting import FitResult, fit
from labctl.fitting.poses.readings import AXES
from studies.poses_simulation import GRAVITY_48_G, Array, Session, Truth, simulate_session

SESSIONS = 200
#: What is hard about a session, beside a quiet one whose latitude is known.
CELLS: Mapping[str, Session] = {
    "latitude known": Session(latitude_deg=48.0),
    "latitude unknown": Session(),
    "warm-up 0.3 deg/s, jitter 0.5 ms": Session(latitude_deg=48.0, warm_up_dps=0.3, jitter_s=5e-4),
    "3 wrong moves": Session(latitude_deg=48.0, wrong_moves=(4, 11, 20)),
}

Scores = dict[str, list[float]]


def run(sessions: int = SESSIONS) -> str:
    """Return the table: coverage of U = 2 u by cell and kind of coefficient, and of held-out components."""
    return "\n".join(row for name, session in CELLS.items() for row in _cell(name, session, sessions))


def _cell(name: str, session: Session, sessions: int) -> list[str]:
    scores: Scores = defaultdict(list)
    within, left_out = [], 0
    for seed in range(sessions):
        recording, truth = simulate_session(seed, session)
        result = fit(recording, "poses")
        score(result, truth, scores, latitude_known=session.latitude_deg is not None)
        assert result.poses is not None
        within.append(result.poses["held_out"]["within_2u"])
        left_out += len(result.poses["moves"]["left_out"])
    rows = [f"   {name}, {sessions} sessions:"]
    for kind, values in scores.items():
        z = np.abs(values)
        share = float(np.mean(z <= 2))
        u = math.sqrt(share * (1 - share) / len(z))
        rows.append(f"      {kind:28} {100 * share:5.1f} % +- {100 * u:.1f} of {len(z)}; largest {z.max():.1f} u")
    rows.append(f"      {'held-out components':28} {100 * float(np.mean(within)):5.1f} %")
    rows.append(f"      {'moves left out':28} {left_out / sessions:.2f} per session")
    return rows


def score(result: FitResult, truth: Truth, scores: Scores, *, latitude_known: bool) -> None:
    """Append (value - truth) / u of every coefficient, by its kind."""
    for i, axis in enumerate(AXES):
        coefficients = result.fitted.axes[axis]
        known = dict(
            zip(coefficients.names, zip(coefficients.values[:, 0], coefficients.u[:, 0], strict=True), strict=True)
        )

        def add(kind: str, name: str, true: float, known: Mapping[str, tuple[float, float]] = known) -> None:
            value, u = known[name]
            scores[kind].append(float((value - true) / u))

        # what wanders has no one value; its mean over the rests and turns is as good as any
        wanders = truth.readings_bias_dps.mean(axis=0) if truth.warms_up else truth.bias_dps
        add("bias", "bias", float(wanders[i]))
        add("scale factor", "scale_factor", truth.gyro[i, i])
        add("g-sensitivity", "g_own", truth.per_g[i, i])
        for j, other in enumerate(AXES):
            if j != i:
                add("misalignment", f"misalignment_{other}", truth.gyro[i, j])
                add("g-sensitivity", f"g_{other}", truth.per_g[i, j])
        _score_alignment(result, truth, scores, i)
        _score_accelerometer(result, truth, scores, i, 1.0 if latitude_known else GRAVITY_48_G)


def _score_alignment(result: FitResult, truth: Truth, scores: Scores, i: int) -> None:
    """The same for the rotation of the gyro triad about one axis."""
    assert result.poses is not None
    assert "alignment" in result.poses
    entry = result.poses["alignment"]["axes"][AXES[i]]
    scores["alignment"].append(float((entry["value"] - turned_deg(truth.gyro, truth.accel)[i]) / entry["u"]))


def turned_deg(gyro: Array, accelerometer: Array) -> Array:
    """Return the rotation vector (3,), deg, from the accelerometer's frame to the gyro's, of errors (3, 3).

    By numpy alone, and by the square root of a product instead of singular values: the frame of axes S is
    (S S')^(-1/2) S. The angle is the logarithm of the rotation as a series, for angles of some degrees.
    """
    turned = _nearest(accelerometer) @ _nearest(gyro).T - np.eye(3)
    log = np.zeros((3, 3))
    for k in range(1, 16):
        log -= (-1.0) ** k * np.linalg.matrix_power(turned, k) / k
    return np.asarray(np.degrees(np.array([log[2, 1], log[0, 2], log[1, 0]])))


def _nearest(errors: Array) -> Array:
    axes = np.eye(3) + errors
    axes = axes / np.linalg.norm(axes, axis=1)[:, None]
    values, vectors = np.linalg.eigh(axes @ axes.T)
    return np.asarray(vectors @ np.diag(values**-0.5) @ vectors.T @ axes)


def _score_accelerometer(result: FitResult, truth: Truth, scores: Scores, i: int, gravity_g: float) -> None:
    """The same for one axis of the accelerometer; without a latitude its scale is that of the local gravity."""
    assert result.poses is not None
    for name, entry in result.poses["accelerometer"]["axes"][AXES[i]].items():
        if name == "bias":
            true = truth.accel_bias_g[i]
        elif name == "scale_factor":
            true = (1 + truth.accel[i, i]) * gravity_g - 1
        else:
            true = truth.accel[i, AXES.index(name[-1])] * gravity_g
        scores["accelerometer " + name.partition("_")[0]].append(float((entry["value"] - true) / entry["u"]))
