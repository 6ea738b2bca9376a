"""A channel of a device, as it is stored with the readings."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class RawChannelJson(TypedDict):
    """A channel as a device sends it: value = offset + scale x whole number."""

    name: str
    """Name of the channel."""
    unit: str
    """Unit of the value."""
    scale: float
    """Value of one count, in `unit`."""
    offset: float
    """Value at count 0, in `unit`."""
    stands_for: NotRequired[str]
    """Column that it replaces, as a reference thermometer replaces temperature_c; absent: none."""
