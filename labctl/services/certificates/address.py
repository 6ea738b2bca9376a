"""Where a version and a certificate are found by their addresses; the QR code leads to that of the certificate."""

from __future__ import annotations

from urllib.parse import quote

from labctl.store import CalibrationRecord

#: Digits of a calibration's hash in the address of a certificate: who has them has the paper, and needs no key. 64 bits
#: cannot be guessed, and the QR code stays readable.
HASH_DIGITS = 16


def address_of(url: str, row: CalibrationRecord) -> str:
    """Return the address of a version; without a laboratory's address the path alone."""
    return f"{url.rstrip('/')}/api/units/{quote(row.serial, safe='')}/calibration?version={row.version}"


def page_of(url: str, number: str, calibration_hash: str) -> str:
    """Return the address of the page that says which state a certificate is in; as above without an address."""
    hash_ = calibration_hash[:HASH_DIGITS]
    return f"{url.rstrip('/')}/certificates?number={quote(number, safe='')}&calibration={hash_}"
