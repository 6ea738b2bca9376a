"""What is said beside the coefficients of a calibration by hand, as JSON."""

from __future__ import annotations

import numpy as np

from labctl.answers.poses import (
    AccelerometerCoefficient,
    AccelerometerJson,
    AlignmentJson,
    HeldOutMovesJson,
    MoveLeftOutJson,
    MovesJson,
    PosesJson,
    RestsJson,
)
from labctl.fitting.numeric.degrees_of_freedom import student_factor
from labctl.fitting.poses.alignment import Alignment
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, different_poses
from labctl.fitting.poses.at_rest.bias import Bias
from labctl.fitting.poses.at_rest.rests import REST_FACTOR, WINDOW_S, Rests
from labctl.fitting.poses.determination import condition_of, turned_deg
from labctl.fitting.poses.gyroscope import Gyroscope
from labctl.fitting.poses.moves import Moves
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import UPPER

FRAME = (
    "body axes by the accelerometer: z along its z axis, its y axis in the plane of y and z; how they lie in the case "
    "is not known"
)
NOT_DETERMINED = (
    "the mounting of the body axes in the case; turns about the vertical, which leave gravity where it is; g-squared "
    "sensitivity and nonlinearity of the scale factors"
)
ALIGNMENT = (
    "rotation vector from the accelerometer's frame to the gyro's, about the accelerometer's axes; the frame of a "
    "triad is the nearest orthonormal one to the directions of its axes"
)
WRONG = "does not agree with the other moves"


def describe(
    readings: PoseReadings, rests: Rests, accelerometer: Accelerometer, bias: Bias, all_moves: Moves, moves: Moves,
    gyro: Gyroscope, alignment: Alignment, applied_rms_dps: float,
) -> PosesJson:  # fmt: skip
    """Return all that is said of a calibration; `moves` are those of `all_moves` that can be used.

    `applied_rms_dps` is what the exported calibration leaves of the used ones.
    """
    return {
        "rests": _rests(rests, accelerometer, bias),
        "accelerometer": accelerometer_json(accelerometer, known=readings.info.latitude_deg is not None),
        "alignment": alignment_json(alignment),
        "moves": _moves(all_moves, moves, gyro, applied_rms_dps),
        "held_out": _held_out(gyro),
        "not_determined": NOT_DETERMINED,
    }


def _rests(rests: Rests, accelerometer: Accelerometer, bias: Bias) -> RestsJson:
    return {
        "count": len(rests),
        "poses": different_poses(accelerometer.up),
        "used": int(np.count_nonzero(accelerometer.used)),
        "window_s": WINDOW_S,
        "factor": REST_FACTOR,
        "noise": {"accel_g": rests.noise[:3].tolist(), "gyro_dps": rests.noise[3:].tolist()},
        "t_s": rests.t_s.tolist(),
        "duration_s": rests.duration_s.tolist(),
        "bias_dps": {axis: bias.rest_dps[:, i].tolist() for i, axis in enumerate(AXES)},
    }


def accelerometer_json(accelerometer: Accelerometer, *, known: bool) -> AccelerometerJson:
    """Return an accelerometer's coefficients by axis; `known`: whether the latitude gave the local gravity."""
    axes: dict[str, dict[str, AccelerometerCoefficient]] = {
        str(axis): {"bias": _of_force(accelerometer, i, float(accelerometer.bias_g[i]), "g")}
        for i, axis in enumerate(AXES)
    }
    for place, (i, j) in enumerate(UPPER):
        name = "scale_factor" if i == j else f"misalignment_{AXES[j]}"
        axes[AXES[i]][name] = _of_force(accelerometer, 3 + place, float(accelerometer.errors[i, j]), "1")
    return {
        "axes": axes,
        "gravity_g": accelerometer.gravity_g,
        "gravity_source": "latitude, at sea level" if known else "standard gravity: the latitude is not known",
        "residual_g": accelerometer.residual_g,
        "frame": FRAME,
    }


def _of_force(accelerometer: Accelerometer, place: int, value: float, unit: str) -> AccelerometerCoefficient:
    freedom = float(accelerometer.u_freedom[place])
    return {"value": value, "u": float(accelerometer.u[place]), "unit": unit, "degrees_of_freedom": freedom}


def alignment_json(alignment: Alignment) -> AlignmentJson:
    """Return the alignment by axis, in deg."""
    angles, u = np.degrees(alignment.angles_rad), np.degrees(alignment.u_rad)
    return {
        "axes": {
            str(axis): {
                "value": float(angles[i]),
                "u": float(u[i]),
                "unit": "deg",
                "degrees_of_freedom": float(alignment.u_freedom[i]),
            }
            for i, axis in enumerate(AXES)
        },
        "covariance_deg2": (alignment.covariance * np.degrees(1.0) ** 2).tolist(),
        "definition": ALIGNMENT,
    }


def alignment_text(alignment: AlignmentJson) -> str:
    """Return an alignment in one sentence, with U."""
    angles = ", ".join(
        f"{each['value']:.3f} +- {student_factor(each.get('degrees_of_freedom')) * each['u']:.3f}"
        for each in alignment["axes"].values()
    )
    return f"Gyro triad turned from the accelerometer triad about x, y, z by {angles} deg (U, 95.45 %)."


def _moves(all_moves: Moves, moves: Moves, gyro: Gyroscope, applied_rms_dps: float) -> MovesJson:
    is_used = gyro.used
    residual = gyro.equations.residual.reshape(-1, 2)[is_used]
    variances = np.diag(gyro.noise).reshape(-1, 2)[is_used]
    rows = np.repeat(is_used, 2)
    return {
        "count": len(all_moves),
        "used": int(np.count_nonzero(is_used)),
        "left_out": _left_out(all_moves, moves, gyro),
        "turned_deg": {str(a): float(v) for a, v in zip(AXES, turned_deg(moves.take(is_used)), strict=True)},
        "residual_deg": float(np.degrees(np.sqrt(np.mean(residual**2)))),
        "applied_rms_dps": applied_rms_dps,
        "known_deg": float(np.degrees(np.sqrt(np.mean(variances)))),
        "extra_deg": float(np.degrees(gyro.extra_rad)),
        "condition": condition_of(gyro.equations.jacobian[rows], gyro.total_of_used),
        "jitter_s": float(np.median(moves.jitter_s)),
    }


def _left_out(all_moves: Moves, moves: Moves, gyro: Gyroscope) -> list[MoveLeftOutJson]:
    reasons = dict(zip(all_moves.before.tolist(), all_moves.why_not, strict=True))
    for place in np.flatnonzero(~gyro.used):
        off = np.degrees(np.linalg.norm(gyro.held_out.error[place]))
        u = np.degrees(np.sqrt(np.trace(gyro.held_out.covariance[place]) / 2))
        reasons[int(moves.before[place])] = (
            f"{WRONG}: gravity after the move is {off:.2g} deg from the direction that the gyro's rates give, u = "
            f"{u:.2g} deg"
        )
    return [
        {"from_s": float(all_moves.t_s[k, 0]), "until_s": float(all_moves.t_s[k, 1]), "why": reasons[int(before)]}
        for k, before in enumerate(all_moves.before)
        if reasons[int(before)]
    ]


def _held_out(gyro: Gyroscope) -> HeldOutMovesJson:
    error = gyro.held_out.error[gyro.used]
    return {
        "rms_deg": float(np.degrees(np.sqrt(np.mean(error**2)))),
        "within_2u": float(np.mean(gyro.held_out.within[gyro.used])),
        "components": int(error.size),
    }
