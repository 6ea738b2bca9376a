"""Which effects a mean rate can show: those whose regressors are linear in the rate, however it ran."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Reference, Term

#: Factors on every rate by which linearity is tested: the other sense, and another size.
FACTORS = (-1.0, 2.0)
#: The columns that are rates.
RATES = ("table_rate_dps", "previous_rate_dps")


def is_linear_in_rate(kind: Effect, term: Term, channels: Channels, axis: str, reference: Reference) -> bool:
    """Return whether the mean of an effect over a data set is that at the mean of the rate, for any course of the rate.

    A regressor is then a constant plus a multiple of the rate; one that follows the table angle, or that enters by a
    law, is not.
    """
    once, none = (kind.columns(_scaled(channels, factor), axis, term, reference) for factor in (1.0, 0.0))
    if any(column.carrier is not None or column.law is not None for column in once):
        return False
    return all(_is_line(once, none, kind.columns(_scaled(channels, f), axis, term, reference), f) for f in FACTORS)


def _is_line(once: list[Column], none: list[Column], seen: list[Column], factor: float) -> bool:
    if not len(once) == len(none) == len(seen):
        return False
    for first, zero, other in zip(once, none, seen, strict=True):
        expected = zero.values + factor * (first.values - zero.values)
        size = float(np.max(np.abs(expected), initial=1e-300))
        if not np.allclose(other.values, expected, rtol=0.0, atol=1e-9 * size):
            return False
    return True


def _scaled(channels: Channels, factor: float) -> Channels:
    """Return channels in which every rate is multiplied by a factor."""
    rates = {name: factor * np.asarray(channels[name], dtype=np.float64) for name in RATES if name in channels}
    return replace(
        channels,
        columns={**channels.columns, **rates},
        rates={axis: factor * values for axis, values in channels.rates.items()},
    )
