"""Opposite mountings of a unit: what their fixture angles differ by is separated from the unit's misalignment.

A unit that turns about x, with x up and down, shows its misalignment towards x with the sign of the rate about x.
The angle by which a face of the fixture is off shows with the sign of the table's rate instead where it is opposite in
the two mountings. Their mean acts as misalignment, and no pair of opposite mountings shows it.
"""

from __future__ import annotations

import numpy as np

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.numeric.arrays import Array

#: Standard deviation of the difference before anything was measured, rad: far above that of any fixture.
WIDE_RAD = 0.1


def face_columns(channels: Channels, axis: str) -> dict[str, Array]:
    """Return the other body axis -> regressor of half the difference between its two mountings, (n,) deg/s.

    Of the axes about which the rows turn with either end up, the table's rate in both of them; empty without any.
    """
    table_dps = channels.table_rate_dps()
    found = {}
    for other in BODY_AXES:
        up = channels.up(other)
        if other != axis and all(np.any(table_dps[up == way]) for way in (1.0, -1.0)):
            found[other] = face_column(channels, other)
    return found


def face_column(channels: Channels, other: str) -> Array:
    """Return the regressor of one axis, (n,) deg/s, whichever of its mountings the rows hold."""
    return np.asarray(np.abs(channels.up(other)) * channels.table_rate_dps())
