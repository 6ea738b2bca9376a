"""Candidates that compete to explain a residual, beside the model as their base: every effect in every shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.channel_functions import channel_options
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.earth_rate import turning_size_dps
from labctl.fitting.data.joined import trend_t_s
from labctl.fitting.effects import CATALOGUE, Column, Effect, Reference, Span, Term
from labctl.fitting.models.error_model import ErrorModel, expand
from labctl.fitting.models.linearity import is_linear_in_rate
from labctl.fitting.numeric.arrays import Array
from labctl.recording.positions import Position

#: Effects that contain several others: a model starts from them, and they are never what is missing.
ONLY_BASE = frozenset({"rate_temperature_surface"})

#: Rates that stand for all of a rate that changes.
RATES_OF_PROFILE = 13
#: Candidate that is a drift of the thermometer: it depends on the temperature as it is logged.
THERMOMETER = "temperature_c"
#: What is not known of a turn at each instant.
RATE = "table_rate_dps"
#: Step by which the base's slope over temperature is computed, K.
SHIFT_K = 0.25


def span_of(data: ReducedRecording) -> Span:
    """Return the rates and channels that a recording covers."""
    if data.nodes.profile is None:
        rates = np.unique(np.round(np.abs(data.at_sets(data.nodes.table_rate_dps())), 3))
    else:  # every rate in between was run
        rates = np.unique(
            np.round(np.quantile(np.abs(data.nodes.table_rate_dps()), np.linspace(0.0, 1.0, RATES_OF_PROFILE)), 3)
        )
    moving = rates[rates > 0]
    fastest = float(moving.max()) if len(moving) else 1.0
    return Span(
        fastest,
        float(moving.min()) if len(moving) else 0.1,
        tuple(rates.tolist()),
        frozenset(data.nodes.columns) | {"table_rate_dps"},
    )


def untestable_channels(data: ReducedRecording, catalogue: Mapping[str, Effect] = CATALOGUE) -> dict[str, list[str]]:
    """Return effects whose channels are not logged, with the channels.

    In a recording of turns the rate at each instant is not known: an effect that is not linear in the rate lacks it.
    """
    needs_by_effect: dict[str, list[str]] = {}
    for kind in catalogue.values():
        absent = [name for name in data.nodes.missing(kind.channels) if name != "run"]
        if not absent and data.info.motion == "turns" and not _takes_mean_rate(data, kind):
            absent = [RATE]
        if absent:
            needs_by_effect[kind.id] = absent
    return needs_by_effect


def _takes_mean_rate(data: ReducedRecording, kind: Effect) -> bool:
    """Whether the mean of the rate over a data set is enough to show an effect, in every shape."""
    reference, terms = Reference(), kind.options(span_of(data))
    return all(is_linear_in_rate(kind, term, data.nodes, axis, reference) for term in terms for axis in data.info.axes)


def base_rows(data: ReducedRecording, model: ErrorModel, axis: str) -> tuple[NDArray[np.float64], list[str], Array]:
    """Return the base's coordinates (R, m, k), its columns' names, and the prior precision of each (k,).

    The base is the model in its forward form, and the Earth's once-per-turn rate where the latitude is known. Held
    coefficients, whose values `beside_held` has subtracted, are known to their uncertainty.
    """
    basis = model.temperature.basis(data.nodes.temperature_c(axis))
    rows: list[NDArray[np.float64]] = []
    names: list[str] = []
    precision: list[Array] = []
    forward = model.forward()
    for effect_id, column in forward.carried(data.nodes, axis):
        if not np.any(column.values):
            continue
        over = np.ones((len(basis), 1)) if effect_id in model.steady else basis
        held = forward.held.of(axis, effect_id, column.name)
        if held is not None:
            if not held.has_u or not min(held.u) > 0:
                continue
            over = basis @ held.spread(model.temperature)
        rows.append(_over_temperature(data, column, over))
        names += [f"{column.name}@{k}" for k in range(over.shape[1])]
        precision.append(np.zeros(over.shape[1]) if held is None else np.array(held.u) ** -2.0)
    turning = _turning(data, axis)
    if turning:
        rows.append(np.stack([data.rows(column) for column in turning], axis=2))
        names += [column.name for column in turning]
        precision.append(np.full(len(turning), 2.0 / turning_size_dps(data.info) ** 2))
    whole = np.concatenate(rows, axis=2) if rows else np.zeros((*data.present.shape, 0))
    return whole, names, np.concatenate([np.zeros(0), *precision])


def beside_held(data: ReducedRecording, model: ErrorModel) -> ReducedRecording:
    """Return a recording whose outputs are without what the held coefficients of a model add to them."""
    forward = model.forward()
    output = dict(data.output)
    for axis in forward.held.axes:
        basis = forward.temperature.basis(data.nodes.temperature_c(axis))
        for effect_id, column in forward.carried(data.nodes, axis):
            if (held := forward.held.of(axis, effect_id, column.name)) is not None:
                over = basis @ held.spread(forward.temperature)
                output[axis] = output[axis] - _over_temperature(data, column, over) @ np.array(held.value)
    return data if not forward.held.axes else replace(data, output=output)


def _over_temperature(data: ReducedRecording, column: Column, basis: Array) -> NDArray[np.float64]:
    """Return the coordinates of a column times each function of temperature, (R, m, k)."""
    if column.carrier is None or column.carrier not in data.waves:
        return data.rows_of(expand(column.values[:, None], basis))
    slow = [data.at_sets(column.values * basis[:, k]) for k in range(basis.shape[1])]
    return np.stack([values * data.waves[column.carrier] for values in slow], axis=2)


def _turning(data: ReducedRecording, axis: str) -> list[Column]:
    if data.info.motion == "turns" or data.info.latitude_deg is None or "table_angle_deg" not in data.nodes:
        return []
    return [
        Column(f"earth_{wave}_{position}", "deg/s", rows.astype(np.float64), (wave, 1))
        for position, rows in data.nodes.positions()
        if Position.of(position).axis != axis
        for wave in ("cos", "sin")
    ]


def options_of(
    data: ReducedRecording,
    axis: str,
    reference: Reference,
    catalogue: Mapping[str, Effect] = CATALOGUE,
    *,
    smooth: bool = True,
) -> list[CandidateShape]:
    """Return every shape of every testable effect on one axis, and with `smooth` a smooth function of every channel."""
    span, absent = span_of(data), untestable_channels(data, catalogue)
    turning = bool(np.any(data.nodes.table_rate_dps()))
    shaped_options = []
    for kind in catalogue.values():
        if not turning and not kind.shows_at_rest:
            continue
        if kind.id in absent or kind.id in ONLY_BASE or _is_known(data, kind.id):
            continue
        options = (option_of(data, axis, reference, kind, term) for term in kind.options(span))
        shaped_options += [option for option in options if option is not None]
    return shaped_options + (channel_options(data, axis) if smooth else [])


def option_of(
    data: ReducedRecording, axis: str, reference: Reference, kind: Effect, term: Term
) -> CandidateShape | None:
    """Return one shape of an effect on one axis, or None where it does not touch the axis."""
    columns = [c for c in kind.columns(data.nodes, axis, term, reference) if np.any(c.values)]
    if not columns or kind.undetermined_by(data.nodes, axis):
        return None
    rows = np.stack([data.rows(column) for column in columns], axis=2)
    return CandidateShape(kind.id, term, rows, tuple(c.name for c in columns), tuple(c.unit for c in columns))


def thermometer_options(data: ReducedRecording, model: ErrorModel, axis: str) -> list[CandidateShape]:
    """Return what a thermometer that drifts in time would do: the base's own slope over temperature, times time."""
    if "t_s" not in data.nodes or (slope := temperature_slope(data, model, axis)) is None:
        return []
    t_s = data.at_sets(trend_t_s(data.info, data.nodes.columns))
    if not np.ptp(t_s) > 0:
        return []
    elapsed = (t_s - t_s.min()) / np.ptp(t_s)
    return [CandidateShape(THERMOMETER, None, (slope * elapsed)[:, :, None], ("thermometer drift",), ("K",))]


def temperature_slope(
    data: ReducedRecording, model: ErrorModel, axis: str, base: NDArray[np.float64] | None = None
) -> NDArray[np.float64] | None:
    """Return the slope of the fitted base over temperature, (R, m) deg/s/K; None where it has none.

    `base` (R, m, k) are the coordinates that `base_rows` gives for the same, where they are known already.
    """
    name = f"temperature_{axis}_c" if f"temperature_{axis}_c" in data.nodes else "temperature_c"
    if name not in data.nodes:
        return None
    base = base_rows(data, model, axis)[0] if base is None else base
    size = np.linalg.norm(base[0], axis=0)
    size = np.where(size > 0, size, np.inf)  # a column that the schedule does not excite has no part in it
    values, *_ = np.linalg.lstsq(base[0] / size, data.error_dps(axis)[0], rcond=1e-9)
    ends = []
    for shift_k in (SHIFT_K, -SHIFT_K):
        columns = {**data.nodes.columns, name: np.asarray(data.nodes[name], dtype=np.float64) + shift_k}
        moved, _, _ = base_rows(replace(data, nodes=replace(data.nodes, columns=columns)), model, axis)
        if moved.shape != base.shape:
            return None
        ends.append(moved @ (values / size))
    slope = np.asarray((ends[0] - ends[1]) / (2 * SHIFT_K))
    return slope if np.any(slope) else None


def _is_known(data: ReducedRecording, effect_id: str) -> bool:
    """Whether an effect is subtracted already: the Earth's rate where the latitude is known."""
    return effect_id == "earth_rate" and data.info.latitude_deg is not None
