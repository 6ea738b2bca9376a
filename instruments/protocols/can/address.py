"""Addresses of CAN buses: can://INTERFACE/CHANNEL?bitrate=N, by the names of python-can.

Further options of the interface may follow the bit rate. What stands behind # has no effect: it tells two units on one
bus apart.
"""

from __future__ import annotations

from typing import NamedTuple
from urllib.parse import parse_qsl, unquote, urlsplit

from instruments.bench_config import CAN_SCHEME

Option = int | float | bool | str


class CanAddress(NamedTuple):
    """What an address says."""

    interface: str
    channel: str
    options: dict[str, Option]


def is_can_address(url: str) -> bool:
    """Return whether an address is a CAN bus."""
    return url.startswith(CAN_SCHEME)


def parsed(url: str) -> CanAddress:
    """Return the parts of an address; raises ValueError."""
    parts = urlsplit(url)
    interface, channel = parts.netloc, unquote(parts.path.removeprefix("/"))
    if not is_can_address(url) or not interface or not channel:
        raise ValueError(
            f"{url!r} is no address of a CAN bus; write "
            "can://INTERFACE/CHANNEL?bitrate=N, such as can://socketcan/can0 or can://slcan//dev/ttyACM0?bitrate=500000"
        )
    options = {name: _option(text) for name, text in parse_qsl(parts.query, keep_blank_values=True)}
    return CanAddress(interface, channel, options)


def _option(text: str) -> Option:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
