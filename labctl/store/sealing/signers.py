"""Private keys that sign manifests: in a file of their owner's, or in a PKCS#11 token (RFC 7512 names it)."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from labctl.config import SEAL_KEY_VARIABLE
from labctl.errors import BadInput
from labctl.extras import needs_extra
from labctl.private_keys import SCHEME, KeyUse, TokenUri, open_session, refuse_open_key, token_uri
from labctl.public_keys import PublicKey, public_key, signed_text
from labctl.store.connection.private_files import FILE

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

SEAL_KEY = KeyUse("seal key", SEAL_KEY_VARIABLE, "; `labctl seal-key create FILE` makes a key")
P256_BYTES = 32


class Signer(Protocol):
    """Something that signs with one key."""

    @property
    def pem(self) -> bytes:
        """The public key."""
        ...

    @property
    def public(self) -> PublicKey:
        """The public key as it is checked with."""
        ...

    def sign(self, digest: str) -> bytes:
        """Return the signature over the hash of a manifest. Raises BadInput; may take as long as a token does."""
        ...


def signer_of(setting: str) -> Signer:
    """Open the key that a setting names: a PEM file, or a PKCS#11 URI. Raises BadInput."""
    with needs_extra("seal", "the seal key"):
        return _token_signer(setting) if setting.startswith(SCHEME) else _file_signer(Path(setting))


@dataclass(frozen=True)
class FileSigner:
    """A key of the cryptography library."""

    pem: bytes
    public: PublicKey
    _key: Ed25519PrivateKey | EllipticCurvePrivateKey

    def sign(self, digest: str) -> bytes:
        """Return the signature; of an ECDSA key r and s, 32 bytes each."""
        from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, EllipticCurvePrivateKey  # noqa: PLC0415
        from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature  # noqa: PLC0415
        from cryptography.hazmat.primitives.hashes import SHA256  # noqa: PLC0415

        if not isinstance(self._key, EllipticCurvePrivateKey):
            return self._key.sign(signed_text(digest))
        r, s = decode_dss_signature(self._key.sign(signed_text(digest), ECDSA(SHA256())))
        return r.to_bytes(P256_BYTES, "big") + s.to_bytes(P256_BYTES, "big")


def _file_signer(path: Path) -> FileSigner:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey  # noqa: PLC0415
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey  # noqa: PLC0415
    from cryptography.hazmat.primitives.serialization import load_pem_private_key  # noqa: PLC0415

    refuse_open_key(path, SEAL_KEY)
    try:
        key = load_pem_private_key(path.read_bytes(), None)
    except (ValueError, TypeError) as error:
        raise BadInput(
            f"seal key {path}: this is no private key in PEM form without a password; use `labctl seal-key create FILE`"
        ) from error
    if not isinstance(key, Ed25519PrivateKey | EllipticCurvePrivateKey):
        raise BadInput(f"seal key {path}: this kind of key is not used; `labctl seal-key create FILE` makes a key")
    pem = _public_pem(key)
    return FileSigner(pem, public_key(pem, str(path)), key)


def _public_pem(key: Ed25519PrivateKey | EllipticCurvePrivateKey) -> bytes:
    from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat  # noqa: PLC0415

    return key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)


def create_key(path: Path) -> FileSigner:
    """Make an Ed25519 key in a new private file, with its public key beside it (.pub). Raises BadInput, OSError."""
    with needs_extra("seal", "a seal key"):
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey  # noqa: PLC0415
        from cryptography.hazmat.primitives.serialization import (  # noqa: PLC0415
            Encoding,
            NoEncryption,
            PrivateFormat,
        )
    beside = Path(f"{path}.pub")
    for each in (path, beside):
        if each.exists() or each.is_symlink():
            raise BadInput(f"{each}: the file exists already, and a key is never overwritten; name a new file")
    key = Ed25519PrivateKey.generate()
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, FILE)
    with os.fdopen(handle, "wb") as file:
        os.fchmod(file.fileno(), FILE)
        file.write(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    beside.write_bytes(_public_pem(key))
    return _file_signer(path)


class TokenSigner:
    """An ECDSA key on P-256 in a PKCS#11 token; it never leaves it."""

    def __init__(self, uri: TokenUri) -> None:
        """Log in and find the key. Raises BadInput."""
        import pkcs11  # noqa: PLC0415  only where a token is used
        from pkcs11.exceptions import PKCS11Error  # noqa: PLC0415  as above
        from pkcs11.util.ec import encode_ec_public_key  # noqa: PLC0415  as above

        place_text = f"seal key {uri.named}"
        try:
            self._session = open_session(uri)
            self._key: Any = self._session.get_key(object_class=pkcs11.ObjectClass.PRIVATE_KEY, label=uri.object)
            public: Any = self._session.get_key(object_class=pkcs11.ObjectClass.PUBLIC_KEY, label=uri.object)
            der = encode_ec_public_key(public)
        except (PKCS11Error, RuntimeError, KeyError, OSError) as error:
            text = " ".join(str(error).split()) or type(error).__name__
            raise BadInput(f"{place_text}: {text}; check token, object, module and PIN") from error
        self._where, self._mechanism, self._trouble = place_text, pkcs11.Mechanism.ECDSA, PKCS11Error
        self.pem = _pem_of(der)
        self.public = public_key(self.pem, place_text)

    def sign(self, digest: str) -> bytes:
        """Return r and s, 32 bytes each, as the token gives them."""
        try:
            signature: bytes = self._key.sign(hashlib.sha256(signed_text(digest)).digest(), mechanism=self._mechanism)
        except self._trouble as error:
            raise BadInput(
                f"{self._where}: {error or type(error).__name__}; nothing was signed; check the token"
            ) from error
        return signature


def _pem_of(der: bytes) -> bytes:
    from cryptography.hazmat.primitives.serialization import (  # noqa: PLC0415
        Encoding,
        PublicFormat,
        load_der_public_key,
    )

    return load_der_public_key(der).public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)


def _token_signer(setting: str) -> TokenSigner:
    return TokenSigner(token_uri(setting, SEAL_KEY))
