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
    moves = moves_between(readings, rests, true)
    moves = moves.take(moves.usable)
    found = uncorrected_errors(moves, accelerometer)
    there = accelerometer.up[moves.before + 1]
    # a small rotation by r turns gravity by r x up, so r = up x what gravity is off by
    about = np.asarray(np.cross(there, np.einsum("mc,mca->ma", found, tangents(there))), dtype=np.float64)
    counted = np.concatenate([[0], np.cumsum(outside)])
    within = np.searchsorted(readings.t_s, moves.t_s)
    return MoveErrors(
        per_second(found, moves.duration_s),
        per_second(about, moves.duration_s),
        counted[within[:, 1] + 1] > counted[within[:, 0]],
    )


def uncorrected_errors(moves: Moves, accelerometer: Accelerometer) -> NDArray[np.float64]:
    """Return the errors of gravity's direction by the moves' rates as they are, (m, 2) rad."""
    rotations = integrate(np.radians(moves.rate_dps), moves.step_s, moves.share, np.zeros((3, 3)))
    there = accelerometer.up[moves.before + 1]
    seen = seen_at_end(accelerometer.up[moves.before], rotations.matrix)
    return np.asarray(np.einsum("mca,ma->mc", tangents(there), seen - there))


def per_second(angle: NDArray[np.float64], seconds: Array) -> NDArray[np.float64]:
    """Return angles (m, k), rad, over durations (m,) s as rates, deg/s."""
    return np.asarray(np.degrees(angle) / seconds[:, None])


def rms_dps(angle: NDArray[np.float64], seconds: Array) -> float:
    """Return the root mean square of angles (m, k), rad, over durations (m,) s, deg/s."""
    return float(np.sqrt(np.mean(per_second(angle, seconds) ** 2)))
