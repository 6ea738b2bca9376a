"""Noise of a data-set mean: white noise of its readings, steps of a coarse output, and an uncertain turn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.fitting.data.channels import body_rates
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.motions.turn_means import TIME
from labctl.recording.motions.turns import USUAL_U_DEG
from labctl.recording.quantisation import QUANTISATION


def white_var_of(points: Recording, axis: str) -> Array | None:
    """Return the variance of each mean of one output, (m,) (deg/s)^2; None without spread or number of readings."""
    columns = points.columns
    spread = columns.get(f"gyro_{axis}_white_std", columns.get(f"gyro_{axis}_std"))
    if spread is None or "n" not in columns:
        return None
    reading = np.asarray(spread, dtype=np.float64) / _scale(points, axis)
    if points.info.motion == "turns":
        reading = _as_at_rest(points, reading)
    variance = reading**2 / np.maximum(np.asarray(columns["n"]), 1) + quantisation_var_of(points, axis)
    return np.asarray(variance + turn_var_of(points, axis) if points.info.motion == "turns" else variance)


def _as_at_rest(points: Recording, reading_dps: Array) -> Array:
    """Return the noise of a reading, (m,), that of the rests in place of a turn's, whose readings also move.

    Without rests each keeps its own: the white level where it is known, which a slow motion does not raise.
    """
    at_rest = np.asarray(points.columns["turn_deg"], dtype=np.float64) == 0
    if not at_rest.any():
        return reading_dps
    return np.where(at_rest, reading_dps, float(np.sqrt(np.mean(reading_dps[at_rest] ** 2))))


def turn_var_of(points: Recording, axis: str) -> Array:
    """Return what uncertain turns and time stamps leave in each mean of one output, (m,) (deg/s)^2.

    The angle's uncertainty enters as the output answers to it: by the scale factor about its own axis, by the
    misalignment about the others. One turn's error is independent of the next one's.
    """
    columns = points.columns
    turn = np.asarray(columns["turn_deg"], dtype=np.float64)
    u_deg = np.asarray(columns.get("turn_u_deg", np.full(len(turn), USUAL_U_DEG)), dtype=np.float64)
    rates = body_rates(np.asarray(columns["table_rate_dps"], dtype=np.float64), np.asarray(columns["position"]))
    share = u_deg / np.where(turn != 0, np.abs(turn), 1.0)
    u_dps = np.where(turn != 0, share * response_dps(rates, points.gyro_dps(axis)), 0.0)
    time = np.asarray(columns.get(f"gyro_{axis}{TIME}", np.zeros(len(turn))), dtype=np.float64) / _scale(points, axis)
    return np.asarray(u_dps**2 + time**2)


def quantisation_var_of(points: Recording, axis: str) -> Array:
    """Return what the steps of one output leave in each mean, (m,) (deg/s)^2; 0 where they are not coarse."""
    quantisation_var = points.columns.get(f"gyro_{axis}{QUANTISATION}")
    if quantisation_var is None:
        return np.zeros(len(points))
    return np.asarray((np.asarray(quantisation_var, dtype=np.float64) / _scale(points, axis)) ** 2)


def response_dps(rates: Mapping[str, Array], output_dps: Array) -> Array:
    """Return the part of an output (m,) that is proportional to the rates along the body axes, (m,) each, deg/s."""
    rate_columns = np.column_stack(list(rates.values()))
    gains, *_ = np.linalg.lstsq(np.column_stack([np.ones(len(rate_columns)), rate_columns]), output_dps, rcond=None)
    return np.asarray(rate_columns @ gains[1:])


def _scale(points: Recording, axis: str) -> float:
    output = next((output_unit for name, output_unit in points.info.output.items() if name == axis), None)
    return abs(output.scale) if output else 1.0
