"""What a calibration by hand says beside its coefficients: rests, accelerometer, moves, held-out moves."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class AccelerometerCoefficient(TypedDict):
    """One coefficient with its standard uncertainty."""

    value: float
    """Estimate, in `unit`."""
    u: float
    """Standard uncertainty, in `unit`."""
    unit: str
    """Unit of the numbers; 1: a ratio."""
    degrees_of_freedom: NotRequired[float]
    """Degrees of freedom nu of `u`: U = t(95.45 %, nu) u, t of Student; absent: stored by an older version, U = 2 u."""


class StaticNoiseJson(TypedDict):
    """Standard deviation of one reading at rest, over the axes x, y, z."""

    accel_g: list[float]
    """Of the accelerometer, g."""
    gyro_dps: list[float]
    """Of the gyro, deg/s."""


class RestsJson(TypedDict):
    """The rests of a recording in poses."""

    count: int
    """Number of rests."""
    poses: int
    """Number of different directions of gravity among the rests."""
    used: int
    """Number of rests that the accelerometer was calibrated with."""
    window_s: float
    """Window over which the scatter is computed, s."""
    factor: float
    """A window is at rest where each channel scatters by less than this many times its static noise."""
    noise: StaticNoiseJson
    """Static noise of one reading."""
    t_s: list[float]
    """Middle of each rest, s."""
    duration_s: list[float]
    """Duration of each rest, s."""
    bias_dps: dict[str, list[float]]
    """Output axis -> mean output at each rest without what the specific force adds, deg/s."""


class AccelerometerJson(TypedDict):
    """The accelerometer by gravity: reading = bias + force + scale_factor x own force + misalignment x another."""

    axes: dict[str, dict[str, AccelerometerCoefficient]]
    """Axis -> name -> coefficient: bias in g, scale_factor and misalignment_y, misalignment_z as ratios."""
    gravity_g: float
    """Local gravity, in standard gravities (9.80665 m/s2)."""
    gravity_source: str
    """Where the local gravity is from."""
    residual_g: float
    """RMS residual of the magnitude of the specific force at rest, g."""
    frame: str
    """How the body axes are defined."""


class AlignmentJson(TypedDict):
    """Rotation of the gyro triad from the accelerometer triad."""

    axes: dict[str, AccelerometerCoefficient]
    """Axis -> component of the rotation vector, deg."""
    covariance_deg2: list[list[float]]
    """Covariance of the components, (3, 3), deg2."""
    definition: str
    """How the rotation is defined."""


class FieldAlignmentJson(TypedDict):
    """Rotation of the magnetometer's axes from the accelerometer's, and the dip of the field."""

    axes: dict[str, AccelerometerCoefficient]
    """Axis -> component of the rotation vector, deg."""
    dip: AccelerometerCoefficient
    """Angle of the field below the horizontal, deg, -90 to 90."""
    covariance_deg2: list[list[float]]
    """Covariance of the three components and the dip, (4, 4), deg2."""
    place_deg: float
    """Standard deviation of a component of the field's direction from rest to rest, beyond the noise, deg."""
    rests: int
    """Number of rests that were used."""
    moves: int
    """Number of moves that were used."""
    definition: str
    """How the rotation is defined."""


class MoveLeftOutJson(TypedDict):
    """A move that the fit did not use."""

    from_s: float
    """Begin of the move, s."""
    until_s: float
    """End of the move, s."""
    why: str
    """Why it was not used."""


class MovesJson(TypedDict):
    """The moves between rests, and the residuals of those that were used: two components square to gravity each."""

    count: int
    """Number of moves."""
    used: int
    """Number of moves that were used."""
    left_out: list[MoveLeftOutJson]
    """Moves that were not used."""
    turned_deg: dict[str, float]
    """Axis -> sum of the magnitudes of all turns about it in the moves that were used, deg."""
    residual_deg: float
    """RMS residual of a component, deg."""
    applied_rms_dps: float
    """RMS error of the exported calibration (one bias throughout, no sensitivity to specific force), deg/s."""
    known_deg: float
    """Standard deviation of a component by all sources that are known, RMS, deg."""
    extra_deg: float
    """Standard deviation of a component beyond that, by the scatter of the residuals, deg."""
    condition: float
    """Condition number of the scaled equations of scale factors and misalignments, at least 1."""
    jitter_s: float
    """Standard deviation of the time stamps about a straight line, median of the moves, s."""


class HeldOutMovesJson(TypedDict):
    """Each used move predicted by a fit to the others."""

    rms_deg: float
    """RMS error of a component, deg."""
    within_2u: float
    """Share of the components within the expanded uncertainty U = 2 u, 0 to 1."""
    components: int
    """Number of components, two for each move."""


class PosesJson(TypedDict):
    """What a calibration in poses reports beside its coefficients."""

    rests: RestsJson
    """The rests."""
    accelerometer: AccelerometerJson
    """The accelerometer, calibrated by gravity."""
    alignment: NotRequired[AlignmentJson]
    """Rotation between gyro and accelerometer; absent: fitted by an older version of labctl."""
    moves: MovesJson
    """The moves between rests."""
    held_out: HeldOutMovesJson
    """Each move predicted by a fit to the others."""
    not_determined: str
    """What such a recording cannot determine, in words."""
