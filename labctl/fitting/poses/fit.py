"""Calibration of a gyro by hand: rests, accelerometer, bias, moves, matrix; then what each of them is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from labctl.fitting.effects import Reference, Term
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.alignment import Alignment, alignment_of
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, calibrate_accelerometer
from labctl.fitting.poses.at_rest.bias import Bias, bias_of
from labctl.fitting.poses.at_rest.rests import Rests, find_rests
from labctl.fitting.poses.covariance import move_covariance, of_readings
from labctl.fitting.poses.description import describe
from labctl.fitting.poses.determination import require_determined, require_moves, require_rests
from labctl.fitting.poses.direction_errors import per_second, rms_dps, uncorrected_errors
from labctl.fitting.poses.equations import equations_of
from labctl.fitting.poses.gyroscope import Gyroscope, fit_gyroscope
from labctl.fitting.poses.moves import Moves, moves_between
from labctl.fitting.poses.readings import AXES, PoseReadings, readings_of
from labctl.fitting.poses.result import PosesFit
from labctl.fitting.poses.triad import corrected
from labctl.recording import Recording

TERMS = tuple(map(Term, ("bias", "scale_factor", "misalignment", "g_sensitivity", "cross_g_sensitivity")))
#: The effect, and the unit, of each coefficient of an axis.
EFFECTS = (
    "bias", "scale_factor", "misalignment", "misalignment",
    "g_sensitivity", "cross_g_sensitivity", "cross_g_sensitivity",
)  # fmt: skip
UNITS = ("deg/s", "1", "1", "1", "deg/s/g", "deg/s/g", "deg/s/g")
#: Reference temperature where there is no thermometer; no coefficient depends on it.
NO_THERMOMETER_C = 25.0


@dataclass(frozen=True)
class Solved:
    """A calibration by hand, step by step."""

    rests: Rests
    accelerometer: Accelerometer
    bias: Bias
    every: Moves
    moves: Moves  #: those that can be used
    gyro: Gyroscope

    @property
    def alignment(self) -> Alignment:
        """Of the gyro triad to the accelerometer triad."""
        return alignment_of(self.moves, self.accelerometer, self.gyro)


def fit_poses(recording: Recording) -> PosesFit:
    """Fit bias, scale factors, misalignments and g-sensitivities to a recording in poses.

    Raises BadInput for a recording of another motion, NotEnoughData where rests or turns do not determine them.
    """
    readings = readings_of(recording)
    return _result(readings, solve(readings))


def solve(readings: PoseReadings, calibrated: tuple[Rests, Accelerometer] | None = None) -> Solved:
    """Calibrate accelerometer and gyro by readings in poses. Raises NotEnoughData as `fit_poses`.

    `calibrated` are the rests of the readings, and an accelerometer that more than these poses tell, such as an
    earlier calibration.
    """
    if calibrated is None:
        rests = find_rests(readings)
        calibrated = rests, calibrate_accelerometer(readings, rests)
    rests, accelerometer = calibrated
    require_rests(readings.info.serial, len(rests))
    force_g = corrected(rests.accel_g, accelerometer.errors, accelerometer.bias_g)
    bias = bias_of(readings, rests, force_g, accelerometer.used)
    every = _moves(readings, rests, accelerometer, bias)
    require_moves(readings.info.serial, every)
    moves = every.take(every.usable)
    start = equations_of(moves, accelerometer, bias, np.zeros((3, 3)))
    readings_u = of_readings(moves, bias)
    noise = move_covariance(moves, accelerometer, bias, start, readings_u)
    require_determined(readings.info.serial, moves, start, noise)
    gyro = fit_gyroscope(moves, accelerometer, bias, readings_u, rests.accel_white_var.mean(axis=1))
    require_determined(readings.info.serial, moves.take(gyro.used), gyro.equations.take(gyro.used), gyro.total_of_used)
    return Solved(rests, accelerometer, bias, every, moves, gyro)


def _moves(readings: PoseReadings, rests: Rests, accelerometer: Accelerometer, bias: Bias) -> Moves:
    """Return the moves, with what the specific force adds to the output taken off."""
    force_g = corrected(readings.accel_g, accelerometer.errors, accelerometer.bias_g)
    return moves_between(readings, rests, readings.gyro_dps - force_g @ bias.per_g.T)


def _result(readings: PoseReadings, solved: Solved) -> PosesFit:
    rests, accelerometer, bias, gyro = solved.rests, solved.accelerometer, solved.bias, solved.gyro
    every, moves, used = solved.every, solved.moves, gyro.used
    seconds = moves.duration_s[used]
    raw = uncorrected_errors(moves_between(readings, rests).take(every.usable), accelerometer)
    exported = corrected(readings.gyro_dps, gyro.errors, bias.mean_dps)
    applied = uncorrected_errors(moves_between(readings, rests, exported).take(every.usable), accelerometer)
    temperature_c = readings.temperature_c
    span = (None, None) if temperature_c is None else (float(temperature_c.min()), float(temperature_c.max()))
    reference = Reference(NO_THERMOMETER_C if temperature_c is None else float(np.round(temperature_c.mean())))
    variances = np.diag(gyro.noise).reshape(-1, 2)[used]
    return PosesFit(
        FittedModel(ErrorModel("poses", TERMS, "rate", reference=reference), _axes(bias, gyro)),
        rms_dps(raw[used], seconds),
        rms_dps(gyro.equations.residual.reshape(-1, 2)[used], seconds),
        rms_dps(gyro.held_out.error[used], seconds),
        float(np.sqrt(np.mean(per_second(np.sqrt(variances), seconds) ** 2))),
        span,
        _rates(moves.take(used), bias, gyro.errors),
        dict(zip(AXES, bias.solutions, strict=True)),
        describe(
            readings, rests, accelerometer, bias, every, moves, gyro, solved.alignment, rms_dps(applied[used], seconds)
        ),
    )


def _rates(moves: Moves, bias: Bias, errors: NDArray[np.float64]) -> tuple[float, float]:
    true = corrected(moves.rate_dps[:, :-1][moves.step_s > 0], errors, bias.mean_dps)
    return float(true.min()), float(true.max())


def _axes(bias: Bias, gyro: Gyroscope) -> dict[str, AxisFit]:
    """Return the coefficients of each axis in the order of the effects; rests and moves are independent of each other.

    They are not quite: a bias also enters the moves beside it. What that makes of the matrix is in its covariance.
    """
    axis_fits = {}
    for i, axis in enumerate(AXES):
        other_axes = [j for j in range(3) if j != i]
        solution, order = bias.solutions[i], [0, 1 + i, *(1 + j for j in other_axes)]
        row, places = gyro.errors[i], [3 * i + i, *(3 * i + j for j in other_axes)]
        covariance = solution.covariance[np.ix_(order, order)]
        matrix = gyro.covariance_of_t[np.ix_(places, places)]
        values = _between(solution.values[order], row[[i, *other_axes]])
        whole = block_diag(covariance[:1, :1], matrix, covariance[1:, 1:])
        whole[0, 4:] = whole[4:, 0] = covariance[0, 1:]
        matrix_names = ("scale_factor", *(f"misalignment_{AXES[j]}" for j in other_axes))
        names = ("bias", *matrix_names, "g_own", *(f"g_{AXES[j]}" for j in other_axes))
        axis_fits[str(axis)] = AxisFit(EFFECTS, names, UNITS, values[:, None], whole)
    return axis_fits


def _between(residual: Array, row: Array) -> Array:
    return np.concatenate([residual[:1], row, residual[1:]])
