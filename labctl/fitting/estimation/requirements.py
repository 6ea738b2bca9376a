"""Requirements of a model on a recording: channels, different rates, different temperatures and their span."""

from __future__ import annotations

import numpy as np

from labctl.errors import NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.mounting_angles import turned_positions
from labctl.fitting.data.tilted_mountings import undetermined
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.linearity import is_linear_in_rate
from labctl.texts import counted

#: A polynomial of order q in temperature needs at least q times this span.
SPAN_PER_ORDER_C = 1.0
#: Effects that have the elements of the matrix beside the scale factors.
ALIGNMENT = frozenset({"misalignment", "non_orthogonality"})


def require_enough_data(data: FitData, model: ErrorModel) -> None:
    """Raise NotEnoughData, saying what is missing and how much, where the data sets cannot determine the model."""
    require_channels(data, model)
    _require_causes(data, model)
    _require_mean_rates(data, model)
    _require_rates(data, model)
    _require_temperatures(data, model)
    _require_directions(data, model)


def require_channels(data: FitData, model: ErrorModel) -> None:
    """Raise NotEnoughData where the recording lacks a column that an effect needs."""
    serial = data.info.serial
    for term in model.terms:
        if absent := data.channels.missing(kind_of(term).channels):
            raise NotEnoughData(
                f"{serial}: effect {term.effect} needs column {absent[0]!r}; the recording has none: add the column, "
                "or leave the effect out"
            )


def _estimated(data: FitData, model: ErrorModel, axes: list[str]) -> list[Term]:
    """Return the effects with a coefficient that is not held, on one of some axes."""
    if not model.held.axes:
        return list(model.terms)
    free = {
        effect
        for axis in axes
        for effect, column in model.columns(data.channels, axis)
        if model.held.of(axis, effect, column.name) is None
    }
    return [term for term in model.terms if term.effect in free]


def _require_causes(data: FitData, model: ErrorModel) -> None:
    """Raise NotEnoughData where what causes an effect does not change enough on any axis to determine it."""
    for term in _estimated(data, model, list(data.outputs)):
        whys = [kind_of(term).undetermined_by(data.channels, axis) for axis in data.outputs]
        if whys and all(whys):
            raise NotEnoughData(
                f"{data.info.serial}: {term.effect} cannot be determined: {whys[0]}; leave the effect out otherwise"
            )


def _require_mean_rates(data: FitData, model: ErrorModel) -> None:
    """Refuse models that turns cannot determine: only the mean of their rate is known."""
    if data.info.motion != "turns":
        return
    for axis in data.outputs:
        for term in model.terms:
            if not is_linear_in_rate(kind_of(term), term, data.channels, axis, model.reference):
                raise NotEnoughData(
                    f"{data.info.serial}: {term.effect} needs the rate at each instant, but only the mean rate of a "
                    "turn is known; leave the effect out, or measure at known rates (motion = 'rates') or with a "
                    "recorded rate "
                    "(motion = 'profile')"
                )


def _require_rates(data: FitData, model: ErrorModel) -> None:
    for axis in data.outputs:
        rates = data.distinct_rates(axis)
        for term in _estimated(data, model, [axis]):
            least, _ = kind_of(term).least(term)
            if rates < least:
                raise NotEnoughData(
                    f"{data.info.serial}, axis {axis}: {term.effect} needs at least {least} different rates; "
                    f"the recording has {rates}; measure at {counted(least - rates, 'more rate')}"
                )


def _require_temperatures(data: FitData, model: ErrorModel) -> None:
    serial = data.info.serial
    temperatures, span = data.distinct_temperatures(), float(np.ptp(data.temperature_c))
    for term in _estimated(data, model, list(data.outputs)):
        _, least = kind_of(term).least(term)
        if temperatures < least:
            raise NotEnoughData(
                f"{serial}: {term.effect} needs at least {least} different temperatures; the recording has "
                f"{temperatures}; measure at {counted(least - temperatures, 'more temperature')}"
            )
        if span < SPAN_PER_ORDER_C * (least - 1):
            raise NotEnoughData(
                f"{serial}: the temperatures span {span:.2f} deg C, too little for order {least - 1} of "
                f"{term.effect}; measure over a span of at least {SPAN_PER_ORDER_C * (least - 1):.0f} deg C, or "
                f"fit a lower order (`{term.effect}:N`)"
            )


def _require_directions(data: FitData, model: ErrorModel) -> None:
    """Refuse tilted mountings that do not separate scale factors and misalignments, where both are estimated."""
    estimated = {term.effect for term in _estimated(data, model, list(data.outputs))}
    if not estimated & ALIGNMENT:
        return
    if ends := undetermined(turned_positions(data.channels)):
        raise NotEnoughData(
            f"{data.info.serial}: positions {ends}: the nine elements of scale factors and misalignments need three "
            "directions along the table axis that are not in one plane; measure further mountings too, such as x, y "
            f"and z, or leave out {' and '.join(sorted(estimated & ALIGNMENT))}"
        )
