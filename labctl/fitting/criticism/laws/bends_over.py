"""Along which channel a law bends most: between the levels of that one it is to be measured next."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.laws.consequences import law_dps
from labctl.fitting.criticism.laws.proposals import Law, where_finite
from labctl.fitting.criticism.laws.shapes import TABLE_RATE, TEMPERATURE
from labctl.fitting.data.channels import Channels
from labctl.fitting.numeric.arrays import Array

#: Places over the range of a channel at which a law is computed.
PLACES = 41


def bends_over(law: Law, criticism: Criticism) -> str:
    """Return whether a law bends more over the rate or over the temperature, on the axis on which it is largest.

    What is compared is the root mean square of what a straight line over the range of the channel leaves of it, with
    the other channels as they are in the data sets. A law without finite values in between counts as one of the rate.
    """
    data = criticism.fit_data
    values = {axis: law_dps(law, data.channels, axis) for axis in data.outputs}
    axis = max(values, key=lambda name: float(np.abs(values[name]).max()))
    if not data.channels.history.thermometer:
        return TABLE_RATE
    fastest_dps = float(np.abs(data.channels.rate_dps(axis)).max())
    over_rate = [_at_rate(data.channels, axis, share * fastest_dps) for share in np.linspace(-1.0, 1.0, PLACES)]
    levels_c = np.linspace(data.temperature_c.min(), data.temperature_c.max(), PLACES)
    over_temperature = [_at_temperature(data.channels, axis, level_c) for level_c in levels_c]
    return TEMPERATURE if _bend(law, axis, over_temperature) > _bend(law, axis, over_rate) else TABLE_RATE


def _at_rate(channels: Channels, axis: str, rate_dps: float) -> Channels:
    return channels.with_rates({**channels.rates, axis: np.full(len(channels), rate_dps)})


def _at_temperature(channels: Channels, axis: str, temperature_c: float) -> Channels:
    same = np.full(len(channels), temperature_c)
    own = {name: same for name in (f"temperature_{axis}_c",) if name in channels.columns}
    return replace(channels, columns={**channels.columns, TEMPERATURE: same, **own})


def _bend(law: Law, axis: str, places: list[Channels]) -> float:
    """Return what a line leaves of a law over the places of a channel, RMS over all rows, deg/s; 0 without values."""
    rows: list[Array | None] = [where_finite(partial(law_dps, law, channels, axis)) for channels in places]
    known = [row for row in rows if row is not None]
    if len(known) < len(rows):
        return 0.0
    values, at = np.array(known), np.linspace(-1.0, 1.0, len(known))
    line = np.column_stack([np.ones(len(at)), at])
    coefficients, *_ = np.linalg.lstsq(line, values, rcond=None)
    return float(np.sqrt(np.mean((values - line @ coefficients) ** 2)))
