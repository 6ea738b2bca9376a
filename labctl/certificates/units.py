"""Units of a certificate: as a person reads them, and in the D-SI (siunitx) form of a DCC."""

from __future__ import annotations

import re

#: labctl's word -> what a person reads.
READ = {"deg/s": "°/s", "deg C": "°C", "deg": "°", "pct": "%", "m/s^2": "m/s²", "uT": "µT"}
#: What a person reads -> D-SI (SI brochure, 9th edition; D-SI 2.2.1).
SYMBOLS = {
    "deg": r"\degree", "°": r"\degree", "s": r"\second", "h": r"\hour", "min": r"\minute", "K": r"\kelvin",
    "°C": r"\degreecelsius", "deg C": r"\degreecelsius", "V": r"\volt", "%": r"\percent", "ppm": r"\ppm", "1": r"\one",
    "hPa": r"\hecto\pascal", "m": r"\metre", "uT": r"\micro\tesla",
}  # fmt: skip
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"([^\^]+)(?:\^(\d+))?")


def readable(unit: str) -> str:
    """Return a unit as a person reads it: deg as the sign of degrees, powers raised."""
    return READ.get(unit, raised(unit.replace("deg C", "°C").replace("deg", "°")))


def raised(text: str) -> str:
    """Return a text with its powers raised: K^-1 as K⁻¹."""
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(_RAISED), text)


def dsi(unit: str) -> str | None:
    """Return a unit in D-SI form; None where D-SI has no word for it, such as a share of standard gravity."""
    above, *below = re.sub(r"/\(([^()/]+)/([^()/]+)\)", r"/\1*\2", unit).split("/")
    dsi_symbol = ""
    for text, sign in [(above, 1), *((part, -1) for part in below)]:
        first, *inverted = text.split("*")
        for name, side in [(first, sign), *((each, -sign) for each in inverted)]:
            parts = _POWER.fullmatch(name.strip())
            symbol = SYMBOLS.get(parts[1]) if parts else None
            if parts is None or symbol is None:
                return None
            power = side * int(parts[2] or 1)
            if symbol != r"\one" or unit == "1":
                dsi_symbol += symbol + ("" if power == 1 else rf"\tothe{{{power}}}")
    return dsi_symbol
