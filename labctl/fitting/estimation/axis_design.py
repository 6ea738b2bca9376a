"""Design matrix of one output axis: the regressors of a model times its functions of temperature."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.earth_rate import turning_columns
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.mounting_angles import AngleColumns
from labctl.fitting.data.shifts import Shift, shifts_of
from labctl.fitting.effects import Column
from labctl.fitting.estimation.held import HeldColumns, HeldPart
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.arrays import Array, block_diagonal

#: A column is a combination of others when less than this share of its length is left beside them.
DEPENDENT_SHARE = 1e-9
#: Different rates that an error in proportion to the rate needs to be distinguished from one that is always there.
TOLD_APART = 2


@dataclass(frozen=True)
class AxisDesign:
    """Design of one axis over m data sets: c estimated columns for k named coefficients at each temperature node."""

    columns: NDArray[np.float64]  #: (m, c)
    spread: NDArray[np.float64]  #: (k * nodes, c): from the estimated columns to the coefficients of the table
    names: list[tuple[str, str, str]]  #: (effect, name, unit) of the k
    turning: NDArray[np.float64]  #: (m, e): the Earth's rate that goes round with the table
    offset_dps: Array  #: (m,): held coefficients, and what laws at their present coefficients have beside the tangent
    held: HeldPart  #: coefficients that are not estimated; their part of the error is in `offset_dps`
    laws: tuple[str, ...]  #: names of the coefficients that enter by a law
    shifts: tuple[Shift, ...]  #: what differs between recordings, where there are several
    angles: AngleColumns  #: of the mountings, as far as they are separated


def axis_design(
    data: FitData, model: ErrorModel, axis: str, at: Mapping[str, NDArray[np.float64]] | None = None,
    known: Collection[str] = (),
) -> AxisDesign:  # fmt: skip
    """Return the design of one axis. Columns that the recording does not exercise are left out, unless they are held.

    Those of coefficients that are `known` beforehand, by name, stay: the recording need not show them.
    A column with a law is its tangent at the coefficients `at`, name -> (nodes,), or where it starts.
    """
    channels = data.seen_by(model.argument)
    steady = model.steady
    basis = model.temperature.basis(data.channels.temperature_c(axis))
    nodes = basis.shape[1]
    columns, spread, names, laws = [np.zeros((len(data), 0))], [], [], []
    held = HeldColumns(basis)
    offset = np.zeros(len(data))
    unknowns = 0
    for owner, column in _exercised(data, model, channels, axis, known):
        values = column.values
        if (held_value := model.held.of(axis, owner, column.name)) is not None:
            held.add(held_value, held_value.spread(model.temperature), values)
            spread.append(np.zeros((nodes, 0)))
            names.append((owner, column.name, column.unit))
            continue
        if not np.any(values) and column.name not in known:
            continue
        if column.law is not None:
            values, beside = _tangent(column, basis @ at[column.name] if at and column.name in at else None)
            offset += beside
            laws.append(column.name)
        added = values[:, None] if owner in steady else values[:, None] * basis
        if owner in steady and _is_dependent(np.concatenate(columns, axis=1), added):
            continue  # an added polynomial repeats the powers that the model has already
        columns.append(added)
        unknowns += added.shape[1]
        _refuse_too_many(
            data, model, axis, unknowns - len(known) * nodes
        )  # before each further column is compared with all of them
        spread.append(np.ones((nodes, 1)) if owner in steady else np.eye(nodes))
        held.add_none()
        names.append((owner, column.name, column.unit))
    held_part = held.part
    return AxisDesign(
        np.concatenate(columns, axis=1), block_diagonal(spread), names, turning_columns(data.info, data.channels, axis),
        offset + held_part.error_dps, held_part, tuple(laws), tuple(shifts_of(data.channels, axis)),
        data.angle_columns(axis),
    )  # fmt: skip


def _refuse_too_many(data: FitData, model: ErrorModel, axis: str, unknowns: int) -> None:
    if unknowns > len(data):
        raise NotEnoughData(
            f"{data.info.serial}, axis {axis}: model {model.name[:80]} has more coefficients than the "
            f"recording's {len(data)} data sets determine; leave effects out, or measure more"
        )


def _tangent(column: Column, at: Array | None) -> tuple[Array, Array]:
    """Return the slope of a law at coefficients (m,), or where it starts, and what the law has beside the tangent."""
    point = np.full(len(column.values), column.start) if at is None else at
    slope = column.slope(point)
    return slope, column.error_dps(point) - slope * point


def _exercised(
    data: FitData, model: ErrorModel, channels: Channels, axis: str, known: Collection[str]
) -> list[tuple[str, Column]]:
    """Return (effect id, regressor) without those that multiply the rate of an axis that had one rate throughout.

    At one rate the part of an effect that grows with the rate is the same as its part at rest, so only that is claimed.
    A held coefficient, or one that is `known` beforehand, is known whatever the recording exercises.
    """
    named_columns = model.columns(channels, axis)
    still = {name for name in channels.rates if data.distinct_rates(name) < TOLD_APART}
    if not still:
        return named_columns
    none = np.zeros(len(data))
    stopped = channels.with_rates({name: none if name in still else v for name, v in channels.rates.items()})
    at_rest = model.columns(stopped, axis)
    return [
        (owner, column)
        for (owner, column), (_, column_at_rest) in zip(named_columns, at_rest, strict=True)
        if np.any(column_at_rest.values) or column.name in known or model.held.of(axis, owner, column.name) is not None
    ]


def _is_dependent(columns: NDArray[np.float64], added: NDArray[np.float64]) -> bool:
    """Return whether a column (m, 1) is a linear combination of others (m, c)."""
    if columns.shape[1] == 0:
        return False
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    solution, *_ = np.linalg.lstsq(scaled, added, rcond=1e-12)
    return float(np.linalg.norm(added - scaled @ solution)) < DEPENDENT_SHARE * float(np.linalg.norm(added))
