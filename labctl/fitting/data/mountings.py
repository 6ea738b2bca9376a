"""How much each mounting of a unit on the table says of the slopes of its outputs over the rate."""

from __future__ import annotations

from collections.abc import Mapping

from labctl.fitting.data.channels import Channels


def mountings_of(channels: Channels) -> dict[str, float]:
    """Return position -> the share of its data sets in what is known of slopes over the rate: squares of the rate."""
    squares = channels.table_rate_dps() ** 2
    return shares_of({position: float(squares[rows].sum()) for position, rows in channels.positions()})


def shares_of(weights: Mapping[str, float]) -> dict[str, float]:
    """Return position -> its share in the whole, of positions with a weight."""
    whole = sum(weights.values())
    return {position: weight / whole for position, weight in weights.items() if weight > 0}


def fitted_shares(measured: Mapping[str, float]) -> dict[str, float]:
    """Return position -> its share in the slopes of a fit, which separates opposite mountings (`face_columns`).

    It takes the mean of two ends of an axis, however much was measured in each.
    """
    axes: dict[str, list[str]] = {}
    for position in measured:
        axes.setdefault(position.lstrip("-"), []).append(position)
    ends = {position: axes[position.lstrip("-")] for position in measured}
    return {position: sum(measured[end] for end in ends[position]) / len(ends[position]) for position in measured}
