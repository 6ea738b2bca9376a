"""Elements of a Digital Calibration Certificate (PTB, schema 3.3.0) that occur in several places of it."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from instruments.laboratory import Contact
from labctl.certificates.units import dsi, readable

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
ENGLISH = "en"
#: Digits of a number: more than any certificate states.
DIGITS = 9


def child(parent: ET.Element, name: str, text: str | None = None, **attributes: str) -> ET.Element:
    """Add an element of the DCC; each run of white space in its text becomes one space, as the schema asks."""
    element = ET.SubElement(parent, f"{{{DCC}}}{name}", attributes)
    if text is not None:
        element.text = " ".join(text.split())
    return element


def referred(ref_type: str) -> dict[str, str]:
    """Return the attribute that says by PTB's word what an element is; none without a word."""
    return {"refType": ref_type} if ref_type else {}


def texts(parent: ET.Element, name: str, *text: str, **attributes: str) -> ET.Element:
    """Add an element with its text in English; `text` is joined, as PTB's rules allow one text per language."""
    element = child(parent, name, **attributes)
    child(element, "content", " ".join(text), lang=ENGLISH)
    return element


def optional(parent: ET.Element, name: str, text: str) -> None:
    """Add an element with a text, unless it is empty."""
    if text.strip():
        child(parent, name, text)


def contact(parent: ET.Element, name: str, person: Contact, further: str = "") -> None:
    """Add the address of an organisation."""
    element = child(parent, name)
    texts(element, "name", person.name)
    optional(element, "eMail", person.email)
    optional(element, "phone", person.phone)
    place = child(element, "location")
    for tag, text in (
        ("city", person.city), ("countryCode", person.country), ("postCode", person.post_code),
        ("street", person.street),
    ):  # fmt: skip
        optional(place, tag, text)
    if further:
        texts(place, "further", further)


def quantity(
    parent: ET.Element,
    name: str,
    values: Sequence[float],
    unit: str,
    *,
    expanded: Sequence[float] = (),
    k: Sequence[float] = (),
    probability: float = 0.9545,
    u: float | None = None,
    element: str = "quantity",
    ref_type: str = "",
) -> ET.Element:
    """Add a quantity: one number, or a list of them, with their expanded uncertainties or one standard uncertainty.

    Where D-SI has no word for the unit the numbers are a text.
    """
    element_made = child(parent, element, **referred(ref_type))
    texts(element_made, "name", name)
    symbol = dsi(unit)
    if symbol is None:
        values_text = "; ".join(f"{value:.{DIGITS}g}" for value in values) + (
            "" if u is None else f", u = {u:.{DIGITS}g}"
        )
        texts(element_made, "noQuantity", f"{values_text} {readable(unit)}")
        return element_made
    several = len(values) > 1
    tail = "XMLList" if several else ""
    real = ET.SubElement(element_made, f"{{{SI}}}{'realListXMLList' if several else 'real'}")
    _si(real, f"value{tail}", _listed(values))
    _si(real, f"unit{tail}", symbol)
    if u is not None:
        standard = _si(_si(real, "measurementUncertaintyUnivariate"), "standardMU")
        _si(standard, "valueStandardMU", _listed([u]))
    elif expanded:
        uncertainty = _si(_si(real, f"measurementUncertaintyUnivariate{tail}"), f"expandedMU{tail}")
        _si(uncertainty, f"valueExpandedMU{tail}", _listed(expanded))
        _si(uncertainty, f"coverageFactor{tail}", _listed(k))
        _si(uncertainty, f"coverageProbability{tail}", _listed([probability]))
    return element_made


def _si(parent: ET.Element, name: str, text: str | None = None) -> ET.Element:
    element = ET.SubElement(parent, f"{{{SI}}}{name}")
    element.text = text
    return element


def _listed(values: Sequence[float]) -> str:
    return " ".join(f"{value:.{DIGITS}g}" for value in values)
