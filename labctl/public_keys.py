"""Signatures over the hash of a manifest, and the public keys that they are checked with."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from labctl.errors import BadInput
from labctl.extras import needs_extra

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePublicKey
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

#: What is signed, before the hash: a signature over a manifest is none over anything else.
CONTEXT = b"labctl-manifest/1\n"


def signed_text(digest: str) -> bytes:
    """Return the bytes that a signature is over."""
    return CONTEXT + digest.encode()


@dataclass(frozen=True)
class PublicKey:
    """A public key, Ed25519 or ECDSA on P-256, and the fingerprint by which it is named."""

    fingerprint: str  #: SHA-256 of its DER form (SubjectPublicKeyInfo)
    _key: Ed25519PublicKey | EllipticCurvePublicKey

    def fits(self, signature: bytes, digest: str) -> bool:
        """Return whether a signature over the hash of a manifest is by this key."""
        from cryptography.exceptions import InvalidSignature  # noqa: PLC0415  only a check with a key needs it
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey  # noqa: PLC0415  as above
        from cryptography.hazmat.primitives.asymmetric.utils import encode_dss_signature  # noqa: PLC0415  as above
        from cryptography.hazmat.primitives.hashes import SHA256  # noqa: PLC0415  as above

        try:
            if isinstance(self._key, Ed25519PublicKey):
                self._key.verify(bytes(signature), signed_text(digest))
            else:
                from cryptography.hazmat.primitives.asymmetric.ec import ECDSA  # noqa: PLC0415  as above

                half = len(signature) // 2  # r and s, as PKCS#11 gives them
                r, s = (int.from_bytes(part, "big") for part in (signature[:half], signature[half:]))
                self._key.verify(encode_dss_signature(r, s), signed_text(digest), ECDSA(SHA256()))
        except (InvalidSignature, ValueError, TypeError):
            return False
        return True


def public_key(content: bytes, location: str) -> PublicKey:
    """Read a public key in PEM form. Raises BadInput."""
    with needs_extra("seal", f"{location}: a signature"):
        from cryptography.hazmat.primitives.asymmetric.ec import (  # noqa: PLC0415  as above
            SECP256R1,
            EllipticCurvePublicKey,
        )
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey  # noqa: PLC0415  as above
        from cryptography.hazmat.primitives.serialization import (  # noqa: PLC0415  as above
            Encoding,
            PublicFormat,
            load_pem_public_key,
        )
    try:
        key = load_pem_public_key(content)
    except (ValueError, TypeError) as error:
        raise BadInput(f"{location}: this is no public key in PEM form; `labctl seal-key create` writes one") from error
    ours = isinstance(key, Ed25519PublicKey) or (
        isinstance(key, EllipticCurvePublicKey) and isinstance(key.curve, SECP256R1)
    )
    if not ours or not isinstance(key, Ed25519PublicKey | EllipticCurvePublicKey):
        raise BadInput(f"{location}: this kind of key is not used; give an Ed25519 key, or ECDSA on the curve P-256")
    der = key.public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)
    return PublicKey(hashlib.sha256(der).hexdigest(), key)


def read_public_key(path: Path) -> PublicKey:
    """Read a public key from a PEM file. Raises BadInput."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInput(
            f"{path}: the public key cannot be read ({error.strerror or error}); name the .pub file that `labctl "
            "seal-key create` writes"
        ) from error
    return public_key(content, str(path))
