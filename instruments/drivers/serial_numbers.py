"""Serial numbers in what instruments say of themselves, compared with those that a bench file gives."""

from __future__ import annotations

import re

from instruments.errors import WrongInstrument


def serial_in(identification: str) -> str:
    """Return the serial number in an answer to `*IDN?`; empty where it has none.

    By IEEE Std 488.2, 10.14, that answer has four fields: manufacturer, model, serial number and firmware. A serial
    number that is not available is 0; some classes write NA.
    """
    fields = [field.strip() for field in identification.split(",")]
    return fields[2] if len(fields) == 4 and any(each in "123456789" for each in fields[2]) else ""


def refuse_other_serial(device: str, identification: str, wanted: str, *, holds_serial: bool) -> None:
    """Raise WrongInstrument for an instrument that says another serial number than `wanted`; empty: any is right.

    `holds_serial`: the identification is known to hold it, as that of a request or an attribute that the bench file
    or a description names. Else it counts only where it has the form of an answer to `*IDN?`.
    """
    reported = serial_in(identification)
    if not wanted or not (holds_serial or reported):
        return
    if reported == wanted or re.search(rf"(?<![\w-]){re.escape(wanted)}(?![\w-])", identification):
        return
    raise WrongInstrument(
        device,
        f"identifies itself as {identification!r}, but the bench file gives serial number {wanted!r}; correct the "
        "address, or serial and certificate, in the bench file; leave serial out where the instrument does not report "
        "it",
    )
