"""What competes to explain a residual: every effect in every shape, and smooth functions of every logged channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.earth import turning_size_dps
from labctl.fitting.effects import CATALOGUE, Column, Effect, Reference, Span, Term
from labctl.fitting.models.error_model import ErrorModel, expand
from labctl.fitting.numeric.arrays import Array

#: Knots of a smooth function of a channel: a coarse and a fine one compete.
KNOTS = (5, 9)
#: Channels of the surroundings may also jump at a value, or come and go so many times over their range: shapes of one
#: and two coefficients, where a smooth function of nine would not pay.
STEPS_AT = (0.2, 0.35, 0.5, 0.65, 0.8)
WAVES_OVER_RANGE = (1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0)
#: A jump is spread over this share of the range.
SPREAD = 0.1
#: What is no channel of the world: numbers of things, what the gyro says, and what belongs to the place in a data set.
NO_CHANNELS = frozenset(
    {
        "dataset", "run", "mounting", "n", "valid", "duration_s", "since_begin_s", "previous_rate_dps", "status",
        "table_angle_deg", "chamber_setpoint_c", "temperature_x_c", "temperature_y_c", "temperature_z_c",
    }
)  # fmt: skip
#: These hold everything that others name, so they are what a model starts from and never what is missing.
ONLY_BASE = frozenset({"rate_temperature_surface"})
TIMES = frozenset({"t_s", "power_s"})
NO_SURROUNDINGS = TIMES | {"table_rate_dps"}


@dataclass(frozen=True)
class Option:
    """One shape of one candidate on one axis: its coordinates (R, m, k) and the coefficients' names and units."""

    candidate: str  #: effect id, or a channel's name with `smooth`
    term: Term | None
    rows: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def smooth(self) -> bool:
        """Whether this is a smooth function of a channel."""
        return self.term is None


def span_of(data: ReducedRecording) -> Span:
    """Return what a recording covers."""
    rates = np.unique(np.round(np.abs(data.at_sets(data.nodes.table_rate_dps())), 3))
    moving = rates[rates > 0]
    fastest = float(moving.max()) if len(moving) else 1.0
    return Span(
        fastest,
        float(moving.min()) if len(moving) else 0.1,
        tuple(rates.tolist()),
        frozenset(data.nodes.columns) | {"table_rate_dps"},
    )


def untestable_channels(data: ReducedRecording, catalogue: Mapping[str, Effect] = CATALOGUE) -> dict[str, list[str]]:
    """Return effects whose channels are not logged, with the channels."""
    found: dict[str, list[str]] = {}
    for kind in catalogue.values():
        absent = [name for name in kind.needs if name not in data.nodes and name != "run"]
        if absent:
            found[kind.id] = absent
    return found


def base_rows(data: ReducedRecording, model: ErrorModel, axis: str) -> tuple[NDArray[np.float64], list[str], Array]:
    """Return the base's coordinates (R, m, k), its columns' names, and the prior precision of each (k,).

    The base is the model in its forward form, and the Earth's rate that goes round where the latitude is known.
    """
    basis = model.temperature.basis(data.nodes.temperature_c(axis))
    rows: list[NDArray[np.float64]] = []
    names: list[str] = []
    for effect_id, column in model.forward().carried(data.nodes, axis):
        if not np.any(column.values):
            continue
        over = np.ones((len(basis), 1)) if effect_id in model.steady else basis
        rows.append(_over_temperature(data, column, over))
        names += [f"{column.name}@{k}" for k in range(over.shape[1])]
    precision = [np.zeros(len(names))]
    turning = _turning(data, axis)
    if turning:
        rows.append(np.stack([data.rows(column) for column in turning], axis=2))
        names += [column.name for column in turning]
        precision.append(np.full(len(turning), 2.0 / turning_size_dps(data.info) ** 2))
    whole = np.concatenate(rows, axis=2) if rows else np.zeros((*data.present.shape, 0))
    return whole, names, np.concatenate(precision)


def _over_temperature(data: ReducedRecording, column: Column, basis: Array) -> NDArray[np.float64]:
    """Return the coordinates of a column times each function of temperature, (R, m, k)."""
    if column.carrier is None or column.carrier not in data.waves:
        return data.rows_of(expand(column.values[:, None], basis))
    slow = [data.at_sets(column.values * basis[:, k]) for k in range(basis.shape[1])]
    return np.stack([values * data.waves[column.carrier] for values in slow], axis=2)


def _turning(data: ReducedRecording, axis: str) -> list[Column]:
    if data.info.latitude_deg is None or "table_angle_deg" not in data.nodes:
        return []
    return [
        Column(f"earth_{wave}_{there}", "deg/s", here.astype(np.float64), (wave, 1))
        for there, here in data.nodes.positions()
        if there.lstrip("-") != axis
        for wave in ("cos", "sin")
    ]


def options_of(
    data: ReducedRecording, axis: str, reference: Reference, catalogue: Mapping[str, Effect] = CATALOGUE
) -> list[Option]:
    """Return every shape of every testable effect on one axis, and a smooth function of every channel."""
    span, absent = span_of(data), untestable_channels(data, catalogue)
    found = []
    for kind in catalogue.values():
        if kind.id in absent or kind.id in ONLY_BASE or _is_known(data, kind.id):
            continue
        options = (option_of(data, axis, reference, kind, term) for term in kind.options(span))
        found += [option for option in options if option is not None]
    return found + _smooth_options(data, axis)


def option_of(data: ReducedRecording, axis: str, reference: Reference, kind: Effect, term: Term) -> Option | None:
    """Return one shape of an effect on one axis, or None where it does not touch the axis."""
    columns = [c for c in kind.columns(data.nodes, axis, term, reference) if np.any(c.values)]
    if not columns:
        return None
    rows = np.stack([data.rows(column) for column in columns], axis=2)
    return Option(kind.id, term, rows, tuple(c.name for c in columns), tuple(c.unit for c in columns))


def _is_known(data: ReducedRecording, effect_id: str) -> bool:
    """Whether an effect is taken off already: the Earth's rate where the latitude is known."""
    return effect_id == "earth_rate" and data.info.latitude_deg is not None


def smooth_channels(data: ReducedRecording, axis: str) -> dict[str, Array]:
    """Return the channels that may be held against the residual, at the nodes; constant ones are left out."""
    channels = {
        name: np.asarray(values, dtype=np.float64)
        for name, values in data.nodes.columns.items()
        if name not in NO_CHANNELS and values.dtype.kind in "fiu" and not name.startswith("gyro_")
    }
    channels["table_rate_dps"] = data.nodes.rate_dps(axis)
    return {name: v for name, v in channels.items() if np.all(np.isfinite(v)) and np.ptp(v) > 1e-9 * (1 + abs(v[0]))}


def _smooth_options(data: ReducedRecording, axis: str) -> list[Option]:
    found = []
    for name, values in smooth_channels(data, axis).items():
        distinct = np.unique(np.round(values, 9))
        for number in KNOTS:
            found += _smooth(data, name, values, np.unique(np.quantile(distinct, np.linspace(0, 1, number))))
        if name not in NO_SURROUNDINGS and len(distinct) > max(KNOTS):
            found += _steps(data, name, values, np.quantile(distinct, STEPS_AT))
            found += _waves(data, name, values)
    return found


def _steps(data: ReducedRecording, name: str, values: Array, places: Array) -> list[Option]:
    half = SPREAD * np.ptp(values) / 2
    return [
        Option(
            name, None, data.rows_of(np.clip((values - place) / half, -1.0, 1.0)[:, None]),
            (f"{name}>{place:.6g}",), ("deg/s",),
        )
        for place in places
    ]  # fmt: skip


def _waves(data: ReducedRecording, name: str, values: Array) -> list[Option]:
    phase = 2 * np.pi * (values - values.min()) / np.ptp(values)
    names, units = (f"cos {name}", f"sin {name}"), ("deg/s", "deg/s")
    return [
        Option(name, None, data.rows_of(np.column_stack([np.cos(n * phase), np.sin(n * phase)])), names, units)
        for n in WAVES_OVER_RANGE
    ]


def _smooth(data: ReducedRecording, name: str, values: Array, knots: Array) -> list[Option]:
    if len(knots) < 3:
        return []
    hats = np.column_stack([np.interp(values, knots, np.eye(len(knots))[k]) for k in range(1, len(knots))])
    names = tuple(f"{name}@{knot:.6g}" for knot in knots[1:])
    return [Option(name, None, data.rows_of(hats), names, ("deg/s",) * len(names))]
