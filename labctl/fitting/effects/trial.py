"""An effect tried on a few made-up data sets before it enters the catalogue: it then competes in every criticism."""

from __future__ import annotations

from typing import Any

import numpy as np

from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.effects.base import Column, Effect, Reference, Span, Term

#: Columns that labctl computes itself.
COMPUTED = ("mounting", "previous_rate_dps")
#: What an effect says of itself.
TOLD = ("id", "term", "sentence", "origin")


def made_up_channels(needs: tuple[str, ...]) -> Channels:
    """Return six data sets, one per position, each at a rate and a temperature of its own, with these columns too."""
    position = np.array(["x", "-x", "y", "-y", "z", "-z"])
    n = len(position)
    rate = np.array([10.0, -20.0, 40.0, -60.0, 80.0, 100.0])
    columns: dict[str, Any] = {name: np.arange(1.0, n + 1) for name in (*COMPUTED, *needs)}
    columns |= {"table_rate_dps": rate, "temperature_c": np.linspace(20.0, 45.0, n), "position": position}
    numbers = tuple(range(1, n + 1))
    history = TemperatureHistory(counted={"run": numbers, "mounting": numbers})
    return Channels(columns, body_rates(rate, position), history)


def first_column(effect: Effect) -> Column:
    """Return the first regressor of an effect on the made-up data sets, with its parameters at their least values."""
    term = Term(effect.id, None, {parameter.name: parameter.low for parameter in effect.parameters})
    return effect.columns(made_up_channels(effect.needs), "z", term, Reference())[0]


def refuse_useless(effect: Effect) -> None:
    """Raise TypeError or ValueError, or what the effect raises, where it cannot be fitted."""
    if missing := [name for name in TOLD if not getattr(effect, name, "")]:
        raise TypeError(f"effect {effect.id!r} does not define {', '.join(missing)}; add it to the class")
    column = first_column(effect)
    n = len(made_up_channels(effect.needs))
    if np.shape(column.values) != (n,):
        raise ValueError(
            f"effect {effect.id!r} returns values of shape {np.shape(column.values)} for {n} data "
            "sets; return one value for each data set"
        )
    span = Span(100.0, 10.0, (10.0, 20.0, 40.0, 60.0, 80.0, 100.0), frozenset(effect.needs))
    if not all(isinstance(term, Term) for term in effect.options(span)):
        raise TypeError(
            f"effect {effect.id!r}: its method options must return objects of class Term; correct the effect"
        )
