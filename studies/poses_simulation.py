"""A unit turned by hand between rests, with known truth: orientations, rates, forces and sensor errors.

Written apart from `labctl.fitting.poses`: the motion is a product of scipy rotations, its rate the difference of
neighbouring orientations, and errors are applied reading by reading.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from labctl.recording import Recording, RecordingInfo

Array = NDArray[np.float64]
EARTH_DPS = 15.041067 / 3600


@dataclass(frozen=True)
class Session:
    """What a person does, and how good the sensors are."""

    rests: int = 30
    rest_s: float = 3.0
    turn_s: tuple[float, float] = (1.5, 3.0)
    rate_hz: float = 100.0
    latitude_deg: float | None = None  #: 48 deg is simulated in any case; this is what the recording says
    gyro_noise_dps: float = 0.05
    accel_noise_g: float = 0.002
    accel_pose_g: float = 0.0002  #: error of the accelerometer that is another in every pose
    drift_dps: float = 0.004  #: standard deviation of the wandering bias
    drift_tau_s: float = 30.0
    warm_up_dps: float = 0.0
    warm_up_tau_s: float = 90.0
    jitter_s: float = 0.0
    full_scale_dps: float = 2000.0
    quantum_dps: float = 0.0
    wrong_moves: tuple[int, ...] = ()  #: moves of which the gyro misses some readings without a mark
    axes_turned: tuple[int, ...] = (0, 1, 2)
    about_vertical: bool = False  #: every turn is about the vertical
    temperature_c: float | None = None  #: of a thermometer, where there is one


@dataclass(frozen=True)
class Truth:
    """Errors of a simulated unit; reading = bias + (I + E) truth."""

    gyro: Array  #: (3, 3) E
    bias_dps: Array  #: (3,)
    per_g: Array  #: (3, 3) deg/s/g
    accel: Array  #: (3, 3) E, upper triangle
    accel_bias_g: Array  #: (3,)
    readings_bias_dps: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (n, 3) with all that wanders
    warms_up: bool = False


def simulate_session(seed: int, session: Session | None = None) -> tuple[Recording, Truth]:
    """Return a recording in poses and what is true of its unit."""
    session = session or Session()
    rng = np.random.default_rng(seed)
    truth = Truth(
        rng.normal(0, 0.01, (3, 3)), rng.normal(0, 1, 3), rng.normal(0, 0.02, (3, 3)),
        np.triu(rng.normal(0, 0.01, (3, 3))), rng.normal(0, 0.03, 3),
    )  # fmt: skip
    t_s, attitude, pose = _path(rng, session)
    rate, force = _true_motion(rng, t_s, attitude, pose)
    bias = truth.bias_dps + _wander(rng, t_s, session)
    gyro = bias + rate @ (np.eye(3) + truth.gyro).T + force @ truth.per_g.T
    gyro += rng.normal(0, session.gyro_noise_dps, gyro.shape)
    gyro = np.clip(gyro, -session.full_scale_dps, session.full_scale_dps)
    if session.quantum_dps:
        gyro = np.round(gyro / session.quantum_dps) * session.quantum_dps
    for move in session.wrong_moves:
        begin = int(np.flatnonzero(pose == move)[-1])
        gyro[begin + 60 : begin + 90] = gyro[begin + 59]
    accel = truth.accel_bias_g + force @ (np.eye(3) + truth.accel).T
    per_pose = rng.normal(0, session.accel_pose_g, (session.rests, 3))
    accel += np.where(pose[:, None] >= 0, per_pose[np.maximum(pose, 0)], 0.0)
    accel += rng.normal(0, session.accel_noise_g, accel.shape)
    stamps = t_s + rng.normal(0, session.jitter_s, len(t_s)) if session.jitter_s else t_s
    truth = Truth(
        truth.gyro, truth.bias_dps, truth.per_g, truth.accel, truth.accel_bias_g, bias, session.warm_up_dps != 0
    )
    return _recording(session, stamps, accel, gyro), truth


def _recording(session: Session, t_s: Array, accel: Array, gyro: Array) -> Recording:
    info = RecordingInfo(
        serial="HAND-1", axes=("x", "y", "z"), kind="samples", motion="poses",
        started_at=datetime(2026, 1, 5, tzinfo=UTC), latitude_deg=session.latitude_deg, technology="mems",
    )  # fmt: skip
    columns: dict[str, NDArray[np.generic]] = {"dataset": np.ones(len(t_s), dtype=np.int64), "t_s": t_s}
    for i, axis in enumerate("xyz"):
        columns |= {f"accel_{axis}_g": accel[:, i], f"gyro_{axis}": gyro[:, i]}
    if session.temperature_c is not None:
        columns["temperature_c"] = np.full(len(t_s), session.temperature_c)
    return Recording(info, columns)


def _path(rng: np.random.Generator, session: Session) -> tuple[Array, Rotation, NDArray[np.int64]]:
    """Return times (n,), orientations body to room, and the pose of each reading, -1 while it is turned."""
    step = 1.0 / session.rate_hz
    at = Rotation.random(rng=rng)
    parts, poses = [], []
    for k in range(session.rests):
        still = round(session.rest_s * session.rate_hz)
        parts.append(np.repeat(at.as_quat()[None], still, axis=0))
        poses.append(np.full(still, k))
        if k + 1 == session.rests:
            break
        n = round(rng.uniform(*session.turn_s) * session.rate_hz)
        share = np.arange(1, n) / n
        smooth = share**3 * (10 - 15 * share + 6 * share**2)
        turn = _turn(rng, session, at)
        wobble = np.zeros(3)
        wobble[list(session.axes_turned)] = rng.normal(0, 0.15, len(session.axes_turned))
        if session.about_vertical or len(session.axes_turned) < 3:
            wobble *= 0.0
        bump = np.sin(np.pi * share) ** 4
        parts.append(
            (at * Rotation.from_rotvec(np.outer(smooth, turn)) * Rotation.from_rotvec(np.outer(bump, wobble))).as_quat()
        )
        poses.append(np.full(n - 1, -1))
        at = at * Rotation.from_rotvec(turn)
    quaternions, pose = np.concatenate(parts), np.concatenate(poses)
    return np.arange(len(pose)) * step, Rotation.from_quat(quaternions), pose


def _turn(rng: np.random.Generator, session: Session, at: Rotation) -> Array:
    """Return a turn of 60 to 170 deg, as a rotation vector in the body."""
    angle = np.radians(rng.uniform(60, 170)) * rng.choice([-1.0, 1.0])
    if session.about_vertical:
        return np.asarray(at.inv().apply([0.0, 0.0, angle]))
    direction = np.zeros(3)
    direction[list(session.axes_turned)] = rng.normal(0, 1, len(session.axes_turned))
    return angle * direction / np.linalg.norm(direction)


def _true_motion(
    rng: np.random.Generator, t_s: Array, attitude: Rotation, pose: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Return rates (n, 3), deg/s, the Earth's included, and specific forces (n, 3), g."""
    between = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / np.diff(t_s)[:, None]
    rate = np.zeros((len(t_s), 3))
    rate[1:-1] = (between[1:] + between[:-1]) / 2
    latitude, heading = np.radians(48.0), rng.uniform(0, 2 * np.pi)
    north = np.cos(latitude) * np.array([np.cos(heading), np.sin(heading), 0.0])
    earth = EARTH_DPS * (north + np.array([0.0, 0.0, np.sin(latitude)]))
    back = attitude.inv()
    push = np.where(pose[:, None] < 0, 0.2 * np.sin(2 * np.pi * t_s[:, None] * np.array([1.1, 1.7, 2.3])), 0.0)
    force = back.apply(np.array([0.0, 0.0, GRAVITY_48_G]) + push)
    return np.degrees(rate) + back.apply(earth), force


#: Normal gravity at 48 deg and sea level over standard gravity (GRS 80 tables: 9.80879 m/s2).
GRAVITY_48_G = 9.80879 / 9.80665


def _wander(rng: np.random.Generator, t_s: Array, session: Session) -> Array:
    """Return an Ornstein-Uhlenbeck process and a warm-up, (n, 3) deg/s."""
    step = float(t_s[1] - t_s[0])
    keep = np.exp(-step / session.drift_tau_s)
    kicks = rng.normal(0, session.drift_dps * np.sqrt(1 - keep**2), (len(t_s), 3))
    found = np.empty_like(kicks)
    found[0] = rng.normal(0, session.drift_dps, 3)
    for k in range(1, len(t_s)):
        found[k] = keep * found[k - 1] + kicks[k]
    warm = session.warm_up_dps * np.exp(-t_s / session.warm_up_tau_s)
    return found + warm[:, None] * np.array([1.0, -0.6, 0.3])
