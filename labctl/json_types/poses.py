"""What a calibration by hand says beside its coefficients: rests, accelerometer, moves, held-out moves."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class AccelerometerCoefficient(TypedDict):
    """One number with its standard uncertainty `u`."""

    value: float
    u: float
    unit: str


class StaticNoiseJson(TypedDict):
    """Noise of one reading at rest, by axis."""

    accel_g: list[float]
    gyro_dps: list[float]


class RestsJson(TypedDict):
    """The rests that were found, and by which threshold."""

    count: int
    poses: int
    used: int
    window_s: float
    factor: float
    noise: StaticNoiseJson
    t_s: list[float]
    duration_s: list[float]
    bias_dps: dict[str, list[float]]


class AccelerometerJson(TypedDict):
    """The accelerometer by gravity: reading = bias + force + scale_factor x own force + misalignment x another."""

    axes: dict[str, dict[str, AccelerometerCoefficient]]
    gravity_g: float
    gravity_source: str
    residual_g: float
    frame: str


class AlignmentJson(TypedDict):
    """Rotation of the gyro triad from the accelerometer triad, as a small angle about each axis, deg."""

    axes: dict[str, AccelerometerCoefficient]
    covariance_deg2: list[list[float]]
    definition: str


class FieldAlignmentJson(TypedDict):
    """Rotation of the magnetometer's axes from the accelerometer's, about each axis, and the dip of the field, deg."""

    axes: dict[str, AccelerometerCoefficient]
    dip: AccelerometerCoefficient
    covariance_deg2: list[list[float]]
    place_deg: float
    rests: int
    moves: int
    definition: str


class MoveLeftOutJson(TypedDict):
    """A move that the fit did without, and why."""

    from_s: float
    until_s: float
    why: str


class MovesJson(TypedDict):
    """The moves between rests, and what is left of them; a residual is one of two components square to gravity.

    `applied_rms_dps` is what the exported calibration leaves: one bias throughout, no sensitivity to specific force.
    """

    count: int
    used: int
    left_out: list[MoveLeftOutJson]
    turned_deg: dict[str, float]
    residual_deg: float
    applied_rms_dps: float
    known_deg: float
    extra_deg: float
    condition: float
    jitter_s: float


class HeldOutMovesJson(TypedDict):
    """Each used move predicted by a fit to the others: root mean square, and the share within U = 2 u."""

    rms_deg: float
    within_2u: float
    components: int


class PosesJson(TypedDict):
    """All of it."""

    rests: RestsJson
    accelerometer: AccelerometerJson
    alignment: NotRequired[AlignmentJson]  #: left out: fitted before it was stated
    moves: MovesJson
    held_out: HeldOutMovesJson
    not_determined: str
