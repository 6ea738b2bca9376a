"""The modelled error over rate and temperature, for surfaces and lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.numeric.arrays import Array
from labctl.services.schemas.calibrations import Surface, SurfaceResponse, Validity
from labctl.store import CalibrationRecord, Store

#: Rounds in which a law of the output is solved for the output; each shrinks the rest a hundredfold or so.
ROUNDS, CLOSE_DPS = 100, 1e-12


def surface_of(store: Store, serial: str, version: int, rate_points: int, temperature_points: int) -> SurfaceResponse:
    """Return the modelled error on a grid over the validity. Raises NotFound, BadInput, NotConverged."""
    row = store.calibrations.get(store.units.get(serial).serial, version)
    calibration = read_calibration(row.document)
    held = _held(store, row, calibration)
    rates, temperatures = _grid(calibration.rate_dps, rate_points), _grid(calibration.temperature_c, temperature_points)
    axes = {
        axis: Surface(
            rate_dps=rates.tolist(), temperature_c=temperatures.tolist(),
            error_dps=_error(calibration.fitted, axis, rates, temperatures, held).tolist(),
        )
        for axis in calibration.axes
    }  # fmt: skip
    validity = Validity(temperature_c=calibration.temperature_c, rate_dps=calibration.rate_dps)
    left_out = list(calibration.document["left_out"])
    return SurfaceResponse(serial=serial, version=version, validity=validity, held=held, left_out=left_out, axes=axes)


def _grid(span: tuple[float, float], points: int) -> Array:
    low, high = span
    return np.linspace(low, high, points) if high > low else np.array([low])


def _held(store: Store, row: CalibrationRecord, calibration: Calibration) -> dict[str, float]:
    """Return what the model's other channels are held at: their means over the recording that it was fitted to."""
    needs = calibration.fitted.model.needs
    if not needs:
        return {}
    columns = store.recordings.points(row.recording).columns if row.recording is not None else {}
    if lacking := [name for name in needs if name not in columns]:
        raise BadInput(
            f"{calibration.serial} version {calibration.version}: its model also needs {', '.join(lacking)}, and its "
            "recording does not say at which value; a surface over rate and temperature alone is not defined"
        )
    return {name: float(np.mean(np.asarray(columns[name], dtype=np.float64))) for name in needs}


def _error(fitted: FittedModel, axis: str, rates: Array, temperatures: Array, held: dict[str, float]) -> Array:
    """Return the error at each temperature and rate, (temperatures, rates) deg/s."""
    n = len(rates) * len(temperatures)
    rate = np.tile(rates, len(temperatures))
    columns: dict[str, Any] = {name: np.full(n, value) for name, value in held.items()}
    columns |= {
        "temperature_c": np.repeat(temperatures, len(rates)),
        "table_rate_dps": rate,
        "position": np.full(n, axis),
    }
    true = {name: rate if name == axis else np.zeros(n) for name in BODY_AXES}
    here = Channels(columns, true)
    error = fitted.error_dps(here, axis) if fitted.model.argument == "rate" else _of_output(fitted, here, axis)
    return error.reshape(len(temperatures), len(rates))


def _of_output(fitted: FittedModel, here: Channels, axis: str) -> Array:
    """Return the error of a law of the output, by finding the outputs that it corrects to the true rates."""
    errors: dict[str, Array] = {name: np.zeros(len(here)) for name in fitted.axes}
    for _ in range(ROUNDS):
        seen = here.with_rates({**here.rates, **{name: here.rates[name] + errors[name] for name in errors}})
        found = {name: fitted.error_dps(seen, name) for name in errors}
        change = max(float(np.max(np.abs(found[name] - errors[name]))) for name in errors)
        errors = found
        if change < CLOSE_DPS * max(1.0, float(np.max(np.abs(here.rates[axis])))):
            return errors[axis]
    raise NotConverged(
        f"model {fitted.model.name!r} has no output for some true rates within its validity: the last round still "
        f"changed it by {change:.3g} deg/s; fit it in the forward form (`labctl improve`)"
    )
