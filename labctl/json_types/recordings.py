"""What a recording holds beside its readings."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class RawChannelJson(TypedDict):
    """A channel as a device sends it: value in `unit` = offset + scale x whole number."""

    name: str
    unit: str
    scale: float
    offset: float
    #: The column that this channel stands for: a reference thermometer for the unit's own.
    stands_for: NotRequired[str]
