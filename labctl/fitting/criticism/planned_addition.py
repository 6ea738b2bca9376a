"""A recording and a planned one as one, before the second is measured: reduced, with runs of its own.

It is to what a joint criticism of both will see what a walk through a plan is to its recording: the same data sets, in
a session of its own, whose shifts of bias, scale factor and mounting angles are free (`fitting.data.shifts`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import Motion
from labctl.errors import BadInput
from labctl.fitting.criticism.candidates import base_rows
from labctl.fitting.criticism.model_comparison import design_of, noise_of
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.criticism.visibility import Schedule, schedule_beside
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.joined import APART_S, COUNTED, WITH_TABLE_RATE
from labctl.fitting.data.rate_profile import profiles_in_turn
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.data.temperature.levels import temperature_levels
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.columns import RECORDING, WITHIN_S
from labctl.recording.positions import comparable

Columns = Mapping[str, NDArray[np.generic]]


def with_planned(measured: ReducedRecording, planned: ReducedRecording, model: ErrorModel) -> ReducedRecording:
    """Return the data sets of a recording (or of several) and behind them those of a plan.

    The output of the planned ones is what the model, fitted to the measured ones, gives there, and their noise that of
    the measured ones over as long a time. Raises BadInput where the two cannot be fitted together.
    """
    if not may_be_joined(measured.info.motion, planned.info.motion):
        raise BadInput(
            f"a recording of {measured.info.motion} and a planned one of {planned.info.motion} cannot be fitted "
            "together; plan one of the same kind"
        )
    planned = planned.through(measured.nodes.response)
    coordinates = max(len(measured.weights), len(planned.weights))
    nodes = max(measured.weights.shape[2], planned.weights.shape[2])
    one, two = (_padded(each, coordinates, nodes) for each in (measured, planned))
    waves = {
        carrier: np.concatenate([one.waves[carrier], two.waves[carrier]], axis=1)
        for carrier in one.waves.keys() & two.waves.keys()
    }
    together = ReducedRecording(
        one.info,
        _joined_channels(one, two),
        np.concatenate([one.weights, two.weights], axis=1),
        waves,
        {axis: np.concatenate([one.output[axis], np.zeros_like(two.output[axis])], axis=1) for axis in one.output},
        np.concatenate([one.present, two.present], axis=1),
        _white_var(measured, planned),
        np.concatenate([one.dataset, two.dataset + int(one.dataset.max(initial=0))]),
        steps=one.steps,
        static=one.static,
    )
    _refuse_between_nodes(together, model)
    return _with_predicted(together, len(measured), model)


def schedule_with_planned(measured: Recording, planned: Recording, model: ErrorModel) -> Schedule:
    """Return the schedule of a recording and, behind it, a planned one, beside the model of a version.

    Raises BadInput where the two cannot be fitted together, NotEnoughData.
    """
    model = model.forward()
    first, second = (reduce_recording(each, outliers=False) for each in (measured, planned))
    if lacking := sorted(set(map(str, first.info.axes)) - set(map(str, second.info.axes))):
        raise BadInput(
            f"the unit of the plan has no output {', '.join(lacking)}, which {first.info.serial} has; plan on a bench "
            "whose unit has the same outputs"
        )
    if first.white_var is None:  # means alone: the scatter beside the model is their noise
        designs = {axis: design_of(first, model, axis, {}) for axis in map(str, first.info.axes)}
        white = {axis: noise_of(first, each, first.error_dps(axis), axis)[0] for axis, each in designs.items()}
        first = replace(first, white_var=white)
    return schedule_beside(with_planned(first, second, model), model)


def may_be_joined(measured: Motion, planned: Motion) -> bool:
    """Return whether a recording and a planned one can be fitted together, by their motions."""
    return {measured, planned} <= WITH_TABLE_RATE or measured == planned == "profile"


def _refuse_between_nodes(together: ReducedRecording, model: ErrorModel) -> None:
    """Raise BadInput where a model with a table over the temperature cannot be fitted, which needs levels."""
    if not isinstance(model.temperature, LagrangeTable):
        return
    temperature_c = together.at_sets(together.nodes.temperature_c(together.info.axes[0]))
    if temperature_levels(temperature_c) is None:
        raise BadInput(
            f"model {model.name} has a table over the temperature, and the planned data sets lie between its "
            "temperatures; plan them at these temperatures"
        )


def _padded(data: ReducedRecording, coordinates: int, nodes: int) -> ReducedRecording:
    """Return data sets with more coordinates, which none of them has, and more nodes, which count nothing."""
    r, m, b = data.weights.shape
    weights = np.zeros((coordinates, m, nodes))
    weights[:r, :, :b] = data.weights
    present = np.zeros((coordinates, m), dtype=bool)
    present[:r] = data.present
    rows = np.minimum(np.arange(nodes), b - 1)[None, :] + b * np.arange(m)[:, None]

    def grown(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([values, np.zeros((coordinates - r, m))])

    return replace(
        data,
        nodes=data.nodes.take(rows.ravel()),
        weights=weights,
        waves={carrier: grown(values) for carrier, values in data.waves.items()},
        output={axis: grown(values) for axis, values in data.output.items()},
        present=present,
    )


def _joined_channels(one: ReducedRecording, two: ReducedRecording) -> Channels:
    first, second = one.nodes, two.nodes
    names = (set(first.columns) & set(second.columns)) | {RECORDING, WITHIN_S}
    before = dict(first.columns)
    after = dict(second.columns)
    n, k = len(first), len(second)
    for columns, rows in ((before, n), (after, k)):
        for name in ("run", "mounting"):
            columns.setdefault(name, np.ones(rows, dtype=np.int64))
            names.add(name)
    before.setdefault(RECORDING, np.zeros(n, dtype=np.int64))
    after[RECORDING] = np.full(k, int(np.max(np.asarray(before[RECORDING]))) + 1)
    shift_s, counted = 0.0, {}
    if "t_s" in names:
        before.setdefault(WITHIN_S, before["t_s"])
        after[WITHIN_S] = after["t_s"]
        t_s = np.asarray(after["t_s"], dtype=np.float64)
        shift_s = float(np.max(np.asarray(before["t_s"], dtype=np.float64))) + APART_S - float(t_s.min())
        after["t_s"] = t_s + shift_s
    else:
        names.discard(WITHIN_S)
    for name in (each for each in COUNTED if each != "dataset"):
        counted[name] = int(np.max(np.asarray(before[name]))) - int(np.min(np.asarray(after[name]))) + 1
        after[name] = np.asarray(after[name]) + counted[name]
    columns = {name: np.concatenate([before[name], after[name]]) for name in sorted(names)}
    columns["position"] = comparable(columns["position"], np.asarray(columns["table_rate_dps"]) != 0)
    rates = {axis: np.concatenate([first.rates[axis], second.rates[axis]]) for axis in first.rates}
    history = _joined_history(first.history, second.history, counted, shift_s)
    if first.profile is None or second.profile is None:
        return Channels(columns, rates, history)
    profile = profiles_in_turn(first.profile, second.profile, shift_s)
    return Channels(columns, rates, history, profile=profile, response=first.response)


def _joined_history(
    first: TemperatureHistory, second: TemperatureHistory, counted: Mapping[str, int], shift_s: float
) -> TemperatureHistory:
    profiles = {
        number + counted["run"]: replace(profile, begin_s=profile.begin_s + shift_s)
        for number, profile in second.profiles.items()
    }
    numbers = {
        name: (*first.numbers(name), *(number + counted[name] for number in second.numbers(name))) for name in counted
    }
    low, high = zip(first.span_c, second.span_c, strict=True)
    return TemperatureHistory(
        {**first.profiles, **profiles}, numbers, max(first.rate_dps, second.rate_dps), (min(low), max(high)),
        first.thermometer and second.thermometer, first.middle_s,
    )  # fmt: skip


def _white_var(one: ReducedRecording, two: ReducedRecording) -> dict[str, Array] | None:
    """Return the white variance of each mean: that of the planned ones falls with their duration."""
    if one.white_var is None:
        return None
    return {axis: np.concatenate([values, variance_of(one, two, values)]) for axis, values in one.white_var.items()}


def variance_of(measured: ReducedRecording, planned: ReducedRecording, variance: Array) -> Array:
    """Return the white variance of planned means, (k,), from that of measured ones, (m,), by their durations."""
    lasted, lasts = (each.nodes.durations_s().reshape(len(each), -1).sum(axis=1) for each in (measured, planned))
    return np.asarray(float(np.median(variance * lasted)) / np.maximum(lasts, 1e-9))


def _with_predicted(together: ReducedRecording, measured: int, model: ErrorModel) -> ReducedRecording:
    """Return the data sets with what the model gives in those behind the measured ones as their output."""
    output = {}
    for axis, values in together.output.items():
        base, _, _ = base_rows(together, model, axis)
        size = np.linalg.norm(base[0, :measured], axis=0)
        size = np.where(size > 0, size, np.inf)  # what the recording does not show has no part in what is predicted
        error = together.error_dps(axis)[0, :measured]
        coefficients, *_ = np.linalg.lstsq(base[0, :measured] / size, error, rcond=1e-9)
        rate = together.rows_of(together.nodes.rate_dps(axis)[:, None])[:, measured:, 0]
        predicted = rate + base[:, measured:] @ (coefficients / size)
        output[axis] = np.concatenate([values[:, :measured], predicted], axis=1)
    return replace(together, output=output)
