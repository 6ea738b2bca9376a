"""The modelled error over rate and temperature, for surfaces and lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.answers.calibrations import Validity
from labctl.answers.uncertainty import Surface, SurfaceResponse
from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.temperature.channel import STAND_IN_C
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.true_rate_error import errors_at_true_rates
from labctl.fitting.numeric.arrays import Array
from labctl.recording.recording import Column
from labctl.recording.verification import fitted_part
from labctl.store import CalibrationRecord, Store

#: Rates that a surface of a model without a rate spans where the unit's are not known, deg/s.
UNKNOWN_MAX_RATE_DPS = 100.0


def surface_of(store: Store, serial: str, version: int, rate_points: int, temperature_points: int) -> SurfaceResponse:
    """Return the modelled error on a grid over the validity. Raises NotFound, BadInput, NotConverged."""
    row = store.calibrations.get(store.units.get(serial).serial, version)
    calibration = read_calibration(row.document)
    held = _held(store, row, calibration)
    rates, temperatures = (
        _grid(_rate_span(store, row, calibration), rate_points),
        _grid(calibration.temperature_c, temperature_points),
    )
    axes = {
        axis: Surface(
            rate_dps=rates.tolist(), temperature_c=temperatures.tolist(),
            error_dps=_error(calibration.fitted, axis, rates, temperatures, held).tolist(),
        )
        for axis in calibration.axes
    }  # fmt: skip
    validity = Validity.model_validate(calibration.document["validity"])
    left_out = list(calibration.document["left_out"])
    return SurfaceResponse(serial=serial, version=version, validity=validity, held=held, left_out=left_out, axes=axes)


def errors_on_grid(
    store: Store, row: CalibrationRecord, rates: Sequence[float], temperatures: Sequence[float]
) -> dict[str, list[list[float]]]:
    """Return axis -> modelled error, deg/s, a row for each temperature, deg C. Raises BadInput, NotConverged."""
    calibration = read_calibration(row.document)
    held = _held(store, row, calibration)
    at = np.asarray(rates, dtype=np.float64), np.asarray(temperatures, dtype=np.float64)
    return {axis: _error(calibration.fitted, axis, *at, held).tolist() for axis in calibration.axes}


def _rate_span(store: Store, row: CalibrationRecord, calibration: Calibration) -> tuple[float, float]:
    """Return the calibrated rates, deg/s; where there is no limit, those of the unit as far as they are known."""
    low, high = calibration.rate_dps
    if np.isfinite(low) and np.isfinite(high):
        return low, high
    max_rate_dps = store.recordings.get(row.recording).info.get("max_rate_dps") if row.recording is not None else None
    fastest = float(max_rate_dps) if isinstance(max_rate_dps, int | float) and max_rate_dps else UNKNOWN_MAX_RATE_DPS
    return -fastest, fastest


def _grid(span: tuple[float, float], points: int) -> Array:
    low, high = span
    if not (np.isfinite(low) and np.isfinite(high)):
        return np.array([STAND_IN_C])  # no thermometer, and so no law of temperature: one is like any other
    return np.linspace(low, high, points) if high > low else np.array([low])


def _held(store: Store, row: CalibrationRecord, calibration: Calibration) -> dict[str, float]:
    """Return what the model's other channels are held at: their means over the recording that it was fitted to."""
    needs = calibration.fitted.model.needs
    if not needs:
        return {}
    columns = fitted_part(store.recordings.points(row.recording)).columns if row.recording is not None else {}
    if lacking := [name for name in needs if name not in columns]:
        raise BadInput(
            f"{calibration.serial} version {calibration.version}: its model also needs {', '.join(lacking)}, "
            "which its recording does not contain, so a surface over rate and temperature alone is not "
            "defined; use a version whose model does not need them"
        )
    return {name: float(np.mean(np.asarray(columns[name], dtype=np.float64))) for name in needs}


def _error(fitted: FittedModel, axis: str, rates: Array, temperatures: Array, held: dict[str, float]) -> Array:
    """Return the error at each temperature and rate, (temperatures, rates) deg/s."""
    n = len(rates) * len(temperatures)
    rate = np.tile(rates, len(temperatures))
    columns: dict[str, Column] = {name: np.full(n, value) for name, value in held.items()}
    columns |= {
        "temperature_c": np.repeat(temperatures, len(rates)),
        "table_rate_dps": rate,
        "position": np.full(n, axis),
    }
    true = {name: rate if name == axis else np.zeros(n) for name in BODY_AXES}
    channels = Channels(columns, true)
    return errors_at_true_rates(fitted, channels)[axis].reshape(len(temperatures), len(rates))
