"""Units as DBC files spell them."""

from __future__ import annotations

from instruments.protocols.stream_formats.units import UNITS

#: Spelling, in small letters without spaces, stops and marks of a power -> key of `UNITS`.
_SPELLINGS: dict[str, tuple[str, ...]] = {
    "deg/s": ("deg/s", "°/s", "deg/sec", "degree/s", "degrees/s", "dps", "º/s", "degs-1"),
    "mdeg/s": ("mdeg/s", "m°/s", "mdps"),
    "deg/h": ("deg/h", "°/h", "deg/hr", "dph"),
    "rad/s": ("rad/s", "rad/sec", "rads-1"),
    "mrad/s": ("mrad/s", "mrad/sec"),
    "deg C": ("degc", "°c", "ºc", "c", "celsius", "degreec", "℃"),
    "K": ("k", "kelvin"),
    "deg F": ("degf", "°f", "fahrenheit"),
    "g": ("g", "gn"),
    "mg": ("mg",),
    "m/s2": ("m/s2", "m/s²", "m/sec2", "m/s/s", "ms-2"),
    "V": ("v", "volt"),
    "mV": ("mv",),
    "": ("", "-", "1"),
}
_BY_SPELLING = {spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings}


def unit_of_text(text: str) -> str | None:
    """Return the key of `UNITS` that a spelling means; None for one that is not known."""
    if text in UNITS:
        return text
    small = "".join(text.split()).lower()
    return _BY_SPELLING.get(small.replace("^", "").replace("**", "").replace("_", "").rstrip("."))
