"""The signers that a reader of certificates expects: by what their subject states, or by a fingerprint."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cryptography import x509

from labctl.certificates.document import Signatory
from labctl.errors import BadInput

#: SHA-256 in hexadecimal digits, as programs write a fingerprint.
_FINGERPRINT = re.compile(r"(?:[0-9A-Fa-f]{2}:?){31}[0-9A-Fa-f]{2}")
Attributes = frozenset[tuple[str, str | bytes]]


def refuse_unreadable(expected: Sequence[str]) -> None:
    """Raise BadInput for a signer that is named by neither a subject nor a fingerprint."""
    for each in expected:
        if not _FINGERPRINT.fullmatch(each):
            _wanted(each)


def is_expected(signer: Signatory, expected: Sequence[str]) -> bool:
    """Return whether a signer is one of those that are expected.

    Each of these is a fingerprint (SHA-256) of a certificate (X.509), or attributes of a subject as RFC 4514 writes
    them, all of which the signer's subject must have.
    """
    return any(_is(signer, each) for each in expected)


def _is(signer: Signatory, expected: str) -> bool:
    if _FINGERPRINT.fullmatch(expected):
        return signer.fingerprint == expected.replace(":", "").lower()
    wanted = _wanted(expected)
    try:
        return wanted <= _attributes(signer.subject)
    except ValueError:  # a subject of attributes that RFC 4514 cannot write
        return signer.subject == expected


def _wanted(expected: str) -> Attributes:
    try:
        if attributes := _attributes(expected):
            return attributes
        reason = "it is empty"
    except ValueError as error:
        reason = str(error)
    raise BadInput(
        f"the expected signer {expected!r} is no subject as RFC 4514 writes it ({reason}) and no fingerprint; give it "
        "as "
        "'CN=Ada Authoriser,O=Laboratory', or the SHA-256 of the certificate in 64 hexadecimal digits"
    )


def _attributes(subject: str) -> Attributes:
    name = x509.Name.from_rfc4514_string(subject)
    return frozenset((each.oid.dotted_string, each.value) for each in name)
