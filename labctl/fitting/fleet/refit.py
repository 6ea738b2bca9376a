"""Refits of many units of a type to their means, with one error model, at the noise that is stated for all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.prior import coefficient_names
from labctl.fitting.fleet.batched import BatchedFit, batched_fit, batched_fit_of_each, chunks
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.drift_noise import Drift


@dataclass(frozen=True)
class Refit:
    """Coefficients of n units on one output axis."""

    names: tuple[str, ...]  #: (k,) `axis.name`, see `labctl.fitting.estimation.prior.coefficient_names`
    fit: BatchedFit


def refit(
    data: FitData, model: ErrorModel, outputs: Mapping[str, NDArray[np.float64]], drift: Mapping[str, Drift]
) -> dict[str, Refit]:
    """Fit a model to the means of n units that were measured as `data` was, axis -> fit.

    `outputs` are the means, axis -> (n, m) deg/s; `data`, one of the units, has the rates, temperatures and white noise
    of all; `drift` is stated by axis. Raises BadInput for a model whose fit is not linear, or has more than its own
    coefficients: held ones, angles of mountings, shifts between recordings, the Earth's turning rate.
    """
    designs = {axis: axis_design(data, model, axis) for axis in data.outputs}
    for axis, design in designs.items():
        _refuse(data, model, axis, design)
    fits = {}
    for axis, design in designs.items():
        owners = [owner for owner, _, _ in design.names]
        names = coefficient_names(model, axis, owners, [name for _, name, _ in design.names])
        true = data.true_rate_dps(axis)
        if model.argument == "rate":
            fit = batched_fit(design.columns, outputs[axis].T - true[:, None], data.scatter(axis), drift[axis])
        else:
            fit = _of_output(data, model, outputs, axis, drift[axis])
        fits[axis] = Refit(tuple(name for name in names if name), fit)
    return fits


def _of_output(
    data: FitData, model: ErrorModel, outputs: Mapping[str, NDArray[np.float64]], axis: str, drift: Drift
) -> BatchedFit:
    """Return the fit of one axis by a law of the outputs, whose design is each unit's own."""
    n, m = outputs[axis].shape
    basis = model.temperature.basis(data.channels.temperature_c(axis))
    columns = model.columns(data.seen_by(model.argument), axis)
    k = sum(1 if owner in model.steady else basis.shape[1] for owner, _ in columns)
    parts = []
    for part in chunks(n, m * (k + 1)):
        some = {name: values[part] for name, values in outputs.items()}
        design = _design(data, model, some, axis, basis)
        parts.append(batched_fit_of_each(design, some[axis] - data.true_rate_dps(axis), data.scatter(axis), drift))
    return BatchedFit(
        np.concatenate([each.values for each in parts]), np.concatenate([each.inverse for each in parts]),
        np.concatenate([each.scale for each in parts]), np.concatenate([each.chi2 for each in parts]),
    )  # fmt: skip


def _design(
    data: FitData, model: ErrorModel, outputs: Mapping[str, NDArray[np.float64]], axis: str, basis: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the designs of units (n, m, k): the model sees all of their data sets as one long recording."""
    n, m = outputs[axis].shape
    every = np.tile(np.arange(m), n)
    channels = data.channels
    columns = {name: np.asarray(values)[every] for name, values in channels.columns.items()}
    rates = {name: np.asarray(values)[every] for name, values in channels.rates.items()}
    rates |= {name: values.ravel() for name, values in outputs.items()}
    long = replace(channels, columns=columns, rates=rates)
    functions = np.tile(basis, (n, 1))
    parts = [
        column.values[:, None] if owner in model.steady else column.values[:, None] * functions
        for owner, column in model.columns(long, axis)
    ]
    return np.concatenate(parts, axis=1).reshape(n, m, -1)


def _refuse(data: FitData, model: ErrorModel, axis: str, design: AxisDesign) -> None:
    """Raise BadInput for what is not linear, or not only the model's own coefficients."""
    why = ""
    if design.laws:
        why = f"its coefficients {', '.join(design.laws)} enter by a law that is not linear"
    elif model.held.axes:
        why = "it holds coefficients"
    elif design.shifts or len(design.angles):
        why = "its recordings or mountings differ, which is fitted beside it"
    elif design.turning.shape[1]:
        why = "the Earth's turning rate is fitted beside it"
    elif model.argument == "output" and design.columns.shape[1] != _columns(data, model, axis):
        why = "the schedule does not show all of its effects"
    if why:
        raise BadInput(
            f"{data.info.serial}, axis {axis}: units cannot be refitted together by model {model.name}, because {why}; "
            "fit each unit alone"
        )


def _columns(data: FitData, model: ErrorModel, axis: str) -> int:
    nodes = model.temperature.basis(data.channels.temperature_c(axis)).shape[1]
    return sum(1 if owner in model.steady else nodes for owner, _ in model.columns(data.seen_by(model.argument), axis))
