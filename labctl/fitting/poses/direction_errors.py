"""Errors of gravity's direction at the end of each move, for outputs corrected in any way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, calibrate_accelerometer
from labctl.fitting.poses.at_rest.rests import find_rests
from labctl.fitting.poses.moves import Moves, moves_between
from labctl.fitting.poses.readings import readings_of
from labctl.fitting.poses.rotation import integrate, seen_at_end
from labctl.fitting.poses.triad import tangents
from labctl.recording import Recording


@dataclass(frozen=True)
class MoveErrors:
    """Errors of m moves whose rotation a corrected output gave."""

    rate_dps: NDArray[np.float64]  #: (m, 2) two components square to gravity, divided by the move's duration
    by_axis_dps: NDArray[np.float64]  #: (m, 3) the same about the body axes; what is about the vertical is not seen
    t_s: NDArray[np.float64]  #: (m, 2) start and end of each move
    accelerometer_deg: Array  #: (m,) by how much gravity's direction moved in the body, by the accelerometer
    gyro_deg: Array  #: (m,) the same by the integrated rates
    residual_deg: Array  #: (m,) angle between gravity's direction at the end by the rates and by the accelerometer
    left_out: tuple[str, ...]  #: moves that cannot be used: when, and why
    outside: NDArray[np.bool_]  #: (m,) whether a reading lay outside what the correction is valid for


#: Outputs (n, 3), deg/s, and the rows (n,) of the recording's valid readings that they are -> true rates, and outside.
Correct = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.bool_]]]


def move_errors(recording: Recording, correct: Correct) -> MoveErrors:
    """Return the errors of a recording's moves by outputs that `correct` has corrected, all readings at once.

    The accelerometer is calibrated by the recording itself. Raises BadInput, NotEnoughData.
    """
    readings = readings_of(recording)
    rests = find_rests(readings)
    accelerometer = calibrate_accelerometer(readings, rests)
    true, outside = correct(readings.gyro_dps)
    every = moves_between(readings, rests, true)
    moves = every.take(every.usable)
    before, up_after = accelerometer.up[moves.before], accelerometer.up[moves.before + 1]
    gravity_seen = gravity_at_end(moves, accelerometer)
    error_across = _square_to(up_after, gravity_seen - up_after)
    # a small rotation by r turns gravity by r x up, so r = up x what gravity is off by
    about = np.asarray(np.cross(up_after, np.einsum("mc,mca->ma", error_across, tangents(up_after))), dtype=np.float64)
    counted = np.concatenate([[0], np.cumsum(outside)])
    within = np.searchsorted(readings.t_s, moves.t_s)
    return MoveErrors(
        per_second(error_across, moves.duration_s),
        per_second(about, moves.duration_s),
        moves.t_s,
        angle_between_deg(before, up_after),
        angle_between_deg(before, gravity_seen),
        angle_between_deg(up_after, gravity_seen),
        tuple(
            f"move from {t[0]:.4g} to {t[1]:.4g} s: {reason}"
            for t, reason in zip(every.t_s, every.why_not, strict=True)
            if reason
        ),
        counted[within[:, 1] + 1] > counted[within[:, 0]],
    )


def uncorrected_errors(moves: Moves, accelerometer: Accelerometer) -> NDArray[np.float64]:
    """Return the errors of gravity's direction by the moves' rates as they are, (m, 2) rad."""
    up_after = accelerometer.up[moves.before + 1]
    return _square_to(up_after, gravity_at_end(moves, accelerometer) - up_after)


def gravity_at_end(moves: Moves, accelerometer: Accelerometer) -> NDArray[np.float64]:
    """Return gravity's direction in the body at the end of each move by its rates as they are, (m, 3)."""
    rotations = integrate(np.radians(moves.rate_dps), moves.step_s, moves.share, np.zeros((3, 3)))
    return seen_at_end(accelerometer.up[moves.before], rotations.matrix)


def angle_between_deg(first: NDArray[np.float64], second: NDArray[np.float64]) -> Array:
    """Return the angles between directions (m, 3) of length 1, (m,) deg; exact also near 0 and 180 deg (Kahan 2006)."""
    apart, along = np.linalg.norm(first - second, axis=1), np.linalg.norm(first + second, axis=1)
    return np.asarray(np.degrees(2 * np.arctan2(apart, along)))


def _square_to(direction: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("mca,ma->mc", tangents(direction), error))


def per_second(angle: NDArray[np.float64], seconds: Array) -> NDArray[np.float64]:
    """Return angles (m, k), rad, over durations (m,) s as rates, deg/s."""
    return np.asarray(np.degrees(angle) / seconds[:, None])


def rms_dps(angle: NDArray[np.float64], seconds: Array) -> float:
    """Return the root mean square of angles (m, k), rad, over durations (m,) s, deg/s."""
    return float(np.sqrt(np.mean(per_second(angle, seconds) ** 2)))
