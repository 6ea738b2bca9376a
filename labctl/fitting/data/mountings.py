"""How much each mounting of a unit on the table says of the slopes of its outputs over the rate."""

from __future__ import annotations

from labctl.fitting.data.channels import Channels


def mountings_of(channels: Channels) -> dict[str, float]:
    """Return position -> the share of its data sets in what is known of slopes over the rate: squares of the rate."""
    squares = channels.table_rate_dps() ** 2
    shares = {position: float(squares[rows].sum()) for position, rows in channels.positions()}
    whole = sum(shares.values())
    return {position: share / whole for position, share in shares.items() if share > 0}
