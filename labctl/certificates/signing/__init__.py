"""Signatures of certificates: PAdES in the PDF, XAdES in the DCC, made by the signing key and verified.

The modules of this package need the extra `labctl[sign]`; they are imported where something is signed or verified.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from labctl.config import SIGN_CERTIFICATE_VARIABLE, SIGN_KEY_VARIABLE, SIGN_PASSWORD_VARIABLE, variable
from labctl.extras import needs_extra
from labctl.private_keys import SCHEME, KeyUse, refuse_open_key

SIGNING_KEY = KeyUse("signing key", SIGN_KEY_VARIABLE)
PASSWORD_FILE = KeyUse("password file", SIGN_PASSWORD_VARIABLE)


@dataclass(frozen=True)
class SigningSettings:
    """What names the signing key."""

    key: str  #: PEM or PKCS#12 file, or PKCS#11 URI; empty: nothing is signed
    certificate: str = ""  #: PEM file of the certificate, and of intermediate ones; empty: they are beside the key
    password_file: str = ""  #: of the key's file; empty: it has no password

    def refuse_open_files(self) -> None:
        """Raise BadInput for a key or password file that is missing, or that others can read or write."""
        if self.key and not self.key.startswith(SCHEME):
            refuse_open_key(Path(self.key), SIGNING_KEY)
        if self.key and self.password_file:
            refuse_open_key(Path(self.password_file), PASSWORD_FILE)


def signing_settings() -> SigningSettings:
    """Return what the environment names."""
    return SigningSettings(
        variable(SIGN_KEY_VARIABLE), variable(SIGN_CERTIFICATE_VARIABLE), variable(SIGN_PASSWORD_VARIABLE)
    )


@contextmanager
def libraries(purpose: str) -> Iterator[None]:
    """Import modules of this package inside; raises BadInput where a library of the extra is missing."""
    with needs_extra("sign", purpose):
        yield
