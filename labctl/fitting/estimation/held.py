"""From coefficients that a person gives to what a model holds: each found in the model, its unit and form checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.fitting.data.channels import Argument, Channels
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import Reference, kind_of
from labctl.fitting.estimation.requirements import require_channels
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.held import Held, HeldCoefficient
from labctl.fitting.models.presets import Preset, holding
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array, block_diagonal
from labctl.fitting.numeric.least_squares import Considered, Solution, rank_of
from labctl.recording import OutputUnit, RecordingInfo

# Uncertainty of held coefficients in those that are estimated beside them: consider covariance analysis.
#
# Tapley, Schutz and Born 2004, Statistical Orbit Determination, chapter 6. The data y = X f + H c + e are fitted for f
# with c held at values of covariance U: f = (X'WX)^-1 X'W (y - H c). An error of c moves f by G = -(X'WX)^-1 X'W H, so
# that f has the covariance (X'WX)^-1 + G U G', and f and c the covariance G U in common.


@dataclass(frozen=True)
class HeldPart:
    """The held coefficients of one axis: h values, for k named coefficients at each temperature node."""

    columns: NDArray[np.float64]  #: (m, h)
    values: Array  #: (h,)
    u: Array  #: (h,) standard uncertainties; NaN: not stated
    spread: NDArray[np.float64]  #: (k * nodes, h): from the values to the coefficients of the table

    @property
    def error_dps(self) -> Array:
        """What they add to the output of the data sets, (m,) deg/s."""
        return np.asarray(self.columns @ self.values)


class HeldColumns:
    """Collects the held part of an axis, coefficient by coefficient; `basis` (m, nodes) is that of the model."""

    def __init__(self, basis: Array) -> None:
        self._basis = basis
        self._columns: list[NDArray[np.float64]] = [np.zeros((len(basis), 0))]
        self._spread: list[NDArray[np.float64]] = []
        self._held: list[HeldCoefficient] = []

    def add(self, coefficient: HeldCoefficient, spread: NDArray[np.float64], values: Array) -> None:
        """Add a held coefficient with its regressor (m,) and its `spread` (nodes, p)."""
        self._columns.append(values[:, None] * (self._basis @ spread))
        self._spread.append(spread)
        self._held.append(coefficient)

    def add_none(self) -> None:
        """Add a coefficient that is estimated."""
        self._spread.append(np.zeros((self._basis.shape[1], 0)))

    @property
    def part(self) -> HeldPart:
        """What was collected."""
        return HeldPart(
            np.concatenate(self._columns, axis=1),
            np.array([value for one in self._held for value in one.value]),
            np.array([u for one in self._held for u in one.u]),
            block_diagonal(self._spread),
        )


def considered(held: HeldPart, columns: NDArray[np.float64], *, knows_white: bool) -> Considered | None:
    """Return what is known beside estimated columns (m, k); None: nothing.

    What an error of a held coefficient leaves in the data is no noise, so the noise is estimated beside it: with its
    uncertainty as a prior; or freely, where the white noise, and so the weight of a prior, is unknown.
    A coefficient without uncertainty is taken as exact, and what it leaves counts as noise.
    """
    if held.columns.shape[1] == 0:
        return None
    has_u = (np.nan_to_num(held.u) > 0) & np.any(held.columns, axis=0)
    beside = held.columns[:, has_u] * held.u[has_u]
    if knows_white:
        return Considered(held.columns, beside, np.ones(beside.shape[1]))
    beside = _determined(columns, beside)
    return Considered(held.columns, beside, np.full(beside.shape[1], np.inf))


def _determined(columns: NDArray[np.float64], more: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return those of more columns (m, b) that the data determine beside columns (m, k), with a row to spare."""
    independent = np.zeros((len(columns), 0))
    for column in more.T:
        tried = np.column_stack([independent, column])
        whole = np.column_stack([columns, tried])
        if len(whole) > whole.shape[1] and rank_of(whole) == whole.shape[1]:
            independent = tried
    return independent


def joint_covariance(
    solution: Solution, held: HeldPart, spread: NDArray[np.float64]
) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients of the table (k * nodes,) and their covariance, of those estimated and held together.

    `spread` (k * nodes, c) is that of the c estimated columns. A held coefficient without uncertainty has NaN in its
    rows and columns; the others are then as certain as if it were exact.
    """
    c = spread.shape[1]
    values = spread @ solution.values[:c] + held.spread @ held.values
    covariance = spread @ solution.covariance[:c, :c] @ spread.T
    h = held.columns.shape[1]
    if solution.along_held is None or h == 0:
        return values, covariance
    root = (spread @ solution.along_held[:c, :h] + held.spread) * np.nan_to_num(held.u)
    covariance = covariance + root @ root.T
    unknown = np.any(held.spread[:, np.isnan(held.u)] != 0, axis=1)
    covariance[unknown, :] = covariance[:, unknown] = np.nan
    return values, covariance


#: Temperatures closer than this are the same level of a table, K.
SAME_LEVEL_K = 1.0
#: Step by which it is seen whether a model depends on its reference temperature, K.
STEP_K = 10.0


@dataclass(frozen=True)
class Fixed:
    """Coefficients to be held, axis -> name -> coefficient; unit and effect are empty where they are not stated."""

    axes: Mapping[str, Mapping[str, HeldCoefficient]]
    name: str  #: of the file, in messages
    source: str = ""  #: where the values are from
    reference_temperature_c: float | None = None  #: zero point of their temperature terms
    argument: Argument | None = None  #: of the law that they belong to; None: of the model that is fitted
    output: Mapping[str, OutputUnit] = field(default_factory=dict)  #: axis -> nominal conversion; {}: the recording's
    only_of_model: bool = False  #: whether those of effects that the model does not have are left out, or are an error


def refuse_fixed(info: RecordingInfo, fixed: Fixed | None) -> None:
    """Raise BadInput for coefficients to be held where nothing is fitted by data sets of known rate."""
    if fixed is not None and (info.kind == "coefficients" or info.motion == "poses"):
        kind_text = "is a table of coefficients" if info.kind == "coefficients" else "is of poses"
        raise BadInput(
            f"{fixed.name}: the recording of {info.serial} {kind_text}, beside which no coefficient can be held; leave "
            "--fixed out, or fit a recording of readings at known rates"
        )


def with_held(data: FitData, preset: Preset, fixed: Fixed | None) -> Preset:
    """Return a preset that holds coefficients.

    Raises BadInput, naming file, axis, coefficient, value and unit, where one cannot be held; NotEnoughData where the
    recording lacks a column that the model needs.
    """
    if fixed is None:
        return preset
    centre = None if fixed.reference_temperature_c is None else Reference(fixed.reference_temperature_c)
    model, _ = holding(preset, Held(), centre).build(data)
    require_channels(data, model)
    return holding(preset, _resolved(data, model, fixed), centre)


def _resolved(data: FitData, model: ErrorModel, fixed: Fixed) -> Held:
    if fixed.argument not in {None, model.argument}:
        raise BadInput(
            f"{fixed.name}: its coefficients belong to a law of the {fixed.argument}, but model {model.name} is a law "
            f"of the {model.argument}, in which they mean something else; fit another model, or give other coefficients"
        )
    channels = data.seen_by(model.argument)
    axes: dict[str, dict[str, HeldCoefficient]] = {}
    for axis, axis_values in fixed.axes.items():
        if axis in data.outputs:
            if held := _of_axis(data, channels, model, axis, fixed):
                axes[axis] = held
        elif axis_values and not fixed.only_of_model:
            raise BadInput(
                f"{fixed.name}, axis {axis}: the recording has only {', '.join(data.outputs)}; leave axis {axis} out"
            )
    if not axes:
        raise BadInput(
            f"{fixed.name}: has no coefficient of the effects of model {model.name} "
            f"({', '.join(model.effect_ids)}); give at least one, or leave --fixed out"
        )
    return Held(axes, fixed.source)


def _of_axis(
    data: FitData, channels: Channels, model: ErrorModel, axis: str, fixed: Fixed
) -> dict[str, HeldCoefficient]:
    columns = {(effect, column.name): column.unit for effect, column in model.columns(channels, axis)}
    owners = {name: effect for effect, name in columns}
    held = {}
    for name, one in fixed.axes[axis].items():
        if fixed.only_of_model and one.effect not in model.effect_ids:
            continue
        effect = one.effect or owners.get(name, "")
        value_text = f"{fixed.name}, axis {axis}: {name} = {_shown(one)}"
        if (effect, name) not in columns:
            raise BadInput(
                f"{value_text}: model {model.name} has no such coefficient; choose from {', '.join(owners)} "
                "(parameters of "
                "the shape of an effect and derived coefficients cannot be held), or add its effect to the model"
            )
        _check(value_text, replace(one, effect=effect), columns[effect, name], model)
        held[name] = replace(one, effect=effect, unit=columns[effect, name])
    if held:
        _require_same_conversion(data, axis, fixed)
        _require_reference(channels, model, axis, fixed)
    if held and len(held) == len(columns):
        raise BadInput(
            f"{fixed.name}, axis {axis}: all coefficients of model {model.name} are held ({', '.join(held)}), so "
            "nothing is left to fit; leave at least one of them out, or add an effect to the model"
        )
    return held


def _check(quantity: str, coefficient: HeldCoefficient, unit_symbol: str, model: ErrorModel) -> None:
    if coefficient.unit and coefficient.unit != unit_symbol:
        raise BadInput(
            f"{quantity}: the unit of this coefficient is {unit_symbol!r}, not {coefficient.unit!r}; write value and u "
            "in it"
        )
    term = next(term for term in model.terms if term.effect == coefficient.effect)
    if kind_of(term).parameters:
        shape = ", ".join(parameter.name for parameter in kind_of(term).parameters)
        raise BadInput(
            f"{quantity}: the shape of effect {coefficient.effect} is fitted ({shape}), so a coefficient of it cannot "
            "be held; "
            "leave the coefficient out"
        )
    if not coefficient.temperature_c:
        return
    nodes = model.temperature.nodes_c if isinstance(model.temperature, LagrangeTable) and not term.steady else ()
    temperatures_text = ", ".join(f"{t:.4g}" for t in coefficient.temperature_c)
    if (
        len(nodes) != len(coefficient.temperature_c)
        or np.abs(np.subtract(nodes, coefficient.temperature_c)).max() > SAME_LEVEL_K
    ):
        has = f"the temperatures {', '.join(f'{t:.4g}' for t in nodes)} deg C" if nodes else "one value for all"
        raise BadInput(
            f"{quantity}: a table at {temperatures_text} deg C, but here the model has {has}; a table is held only at "
            "the same "
            f"temperatures, to {SAME_LEVEL_K:g} K: give a single value, or fit a model with these temperatures"
        )


def _require_same_conversion(data: FitData, axis: str, fixed: Fixed) -> None:
    """Refuse coefficients of an output that is converted to deg/s by another scale or offset."""
    if axis not in fixed.output:
        return
    of_recording, of_file = data.info.output.get(axis, OutputUnit()), fixed.output[axis]  # type: ignore[call-overload]
    if not (
        math.isclose(of_recording.scale, of_file.scale)
        and math.isclose(of_recording.offset, of_file.offset, abs_tol=1e-12)
    ):
        raise BadInput(
            f"{fixed.name}, axis {axis}: its coefficients are of an output of scale {of_file.scale:g} and offset "
            f"{of_file.offset:g} {of_file.unit}, but the recording has scale {of_recording.scale:g} and offset "
            f"{of_recording.offset:g} {of_recording.unit}; give coefficients of the same conversion"
        )


def _require_reference(channels: Channels, model: ErrorModel, axis: str, fixed: Fixed) -> None:
    """Refuse coefficients without a reference temperature beside terms in temperature, which change their meaning."""
    if fixed.reference_temperature_c is not None:
        return
    shifted_model = replace(model, reference=Reference(model.reference.temperature_c + STEP_K))
    pairs = zip(model.columns(channels, axis), shifted_model.columns(channels, axis), strict=True)
    centred = [effect for (effect, column), (_, shifted) in pairs if not np.array_equal(column.values, shifted.values)]
    if centred:
        raise BadInput(
            f"{fixed.name}: effect {centred[0]} is centred on a reference temperature, on which the other coefficients "
            "depend; add the one that the values hold for, such as reference_temperature_c = 25.0 (deg C)"
        )


def _shown(coefficient: HeldCoefficient) -> str:
    values = ", ".join(f"{value:g}" for value in coefficient.value[:3]) + (
        ", ..." if len(coefficient.value) > 3 else ""
    )
    text = f"[{values}]" if coefficient.temperature_c else values
    return f"{text} {coefficient.unit}".strip()
