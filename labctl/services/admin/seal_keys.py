"""Seal keys: made, shown, and used to sign what has no signature yet."""

from __future__ import annotations

from pathlib import Path

from labctl.answers.admin import SealKeyResponse, SignedResponse
from labctl.certificates.signing import signing_settings
from labctl.config import SEAL_KEY_VARIABLE, default_database, seal_key
from labctl.errors import BadInput
from labctl.private_keys import SCHEME, refuse_open_key
from labctl.store import SEAL_KEY, Signer, create_key, sign_chain, signer_of


def create_seal_key(path: Path) -> SealKeyResponse:
    """Make a key in a new file. Raises BadInput, OSError."""
    return _shown(create_key(path), path)


def show_seal_key() -> SealKeyResponse:
    """Return the public key of the key in use. Raises BadInput."""
    return _shown(signer_of(_setting()))


def sign(database: str | None) -> SignedResponse:
    """Sign the end of the chain now. Raises BadInput, Conflict, StoreError."""
    setting = _setting()
    head = sign_chain(database or default_database(), setting)
    fingerprint = signer_of(setting).public.fingerprint
    return SignedResponse(signed=None if head is None else head.length, fingerprint=fingerprint)


def refuse_unusable_keys() -> None:
    """Raise BadInput for a file of the seal key or of the signing key that is missing or open to others.

    A token is asked only when it signs.
    """
    signing_settings().refuse_open_files()
    if (setting := seal_key()) and not setting.startswith(SCHEME):
        refuse_open_key(Path(setting), SEAL_KEY)


def _setting() -> str:
    if setting := seal_key():
        return setting
    raise BadInput(
        f"{SEAL_KEY_VARIABLE} is not set; name the seal key by it: a file that `labctl seal-key create FILE` made, "
        "or a PKCS#11 URI"
    )


def _shown(signer: Signer, path: Path | None = None) -> SealKeyResponse:
    return SealKeyResponse(
        fingerprint=signer.public.fingerprint,
        public_key=signer.pem.decode(),
        file=None if path is None else str(path),
        public_file=None if path is None else f"{path}.pub",
    )
