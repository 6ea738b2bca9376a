"""Which effects a mean rate can show: those whose regressors are linear in the rate, however it ran."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects import Column, Effect, Reference, Term
from labctl.fitting.numeric.arrays import Array

#: Factors by which the rates of the data sets are multiplied in turn, to see whether a regressor follows in proportion.
FACTORS = (-1.0, 2.0, 0.3, 100.0)
#: The columns that are rates.
RATES = ("table_rate_dps", "previous_rate_dps")


def is_linear_in_rate(kind: Effect, term: Term, channels: Channels, axis: str, reference: Reference) -> bool:
    """Return whether the mean of an effect over a data set is that at the mean of the rate, for any course of the rate.

    A regressor is then a constant plus a multiple of the rate, row by row; one that follows the table angle, or that
    enters by a law, is not.
    """
    factor = np.resize(np.array(FACTORS), len(channels))
    once, none, other = (
        kind.columns(_scaled(channels, by), axis, term, reference)
        for by in (np.ones(len(channels)), np.zeros(len(channels)), factor)
    )
    if any(column.carrier is not None or column.law is not None for column in once):
        return False
    if not len(once) == len(none) == len(other):
        return False
    return all(_is_line(*columns, factor) for columns in zip(once, none, other, strict=True))


def _is_line(once: Column, none: Column, other: Column, factor: Array) -> bool:
    expected = none.values + factor * (once.values - none.values)
    size = np.maximum(np.abs(once.values), np.abs(none.values)) * np.maximum(np.abs(factor), 1.0)
    return bool(np.all(np.abs(other.values - expected) <= 1e-9 * size))


def _scaled(channels: Channels, factor: Array) -> Channels:
    """Return channels in which the rates of each row are multiplied by a factor, (n,)."""
    rates = {name: factor * np.asarray(channels[name], dtype=np.float64) for name in RATES if name in channels}
    return replace(
        channels,
        columns={**channels.columns, **rates},
        rates={axis: factor * values for axis, values in channels.rates.items()},
    )
