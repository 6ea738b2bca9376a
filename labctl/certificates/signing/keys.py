"""The signing key of a laboratory with its certificate (X.509): from a PEM or PKCS#12 file, or in a PKCS#11 token."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, EllipticCurvePrivateKey, EllipticCurvePublicKey
from cryptography.hazmat.primitives.asymmetric.padding import PKCS1v15
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey, RSAPublicKey
from cryptography.hazmat.primitives.asymmetric.utils import encode_dss_signature
from cryptography.hazmat.primitives.serialization import Encoding, load_pem_private_key
from cryptography.hazmat.primitives.serialization.pkcs12 import load_key_and_certificates

from labctl.certificates.document import Signatory
from labctl.certificates.signing import PASSWORD_FILE, SIGNING_KEY, SigningSettings
from labctl.config import SIGN_CERTIFICATE_VARIABLE, SIGN_KEY_VARIABLE, SIGN_PASSWORD_VARIABLE
from labctl.errors import BadInput
from labctl.private_keys import SCHEME, TokenUri, open_session, read_secret, refuse_open_key, token_uri

PublicKey = RSAPublicKey | EllipticCurvePublicKey
Digest = Literal["sha256", "sha384"]
#: Least size of an RSA key, bit (ETSI TS 119 312).
RSA_BITS = 2048


@dataclass(frozen=True)
class SigningKey:
    """A private key that is ready to sign, with the certificate of its public key."""

    where: str
    certificate: x509.Certificate
    chain: tuple[x509.Certificate, ...]  #: of intermediate certificates, as they were given
    _sign: Callable[[bytes], bytes]
    close: Callable[[], object] = lambda: None  #: ends the session with a token

    @property
    def digest(self) -> Digest:
        """The hash that is signed."""
        return digest_of(_public(self.certificate, self.where))

    @property
    def signatory(self) -> Signatory:
        """Who signs."""
        return signatory_of(self.certificate)

    def refuse_outside_validity(self, at: datetime) -> None:
        """Raise BadInput where the certificate is not valid at an aware time."""
        first, last = self.certificate.not_valid_before_utc, self.certificate.not_valid_after_utc
        if not first <= at <= last:
            problem = "has expired" if at > last else "is not valid yet"
            raise BadInput(
                f"{self.where}: its certificate ({self.signatory.subject}) {problem}: it is valid "
                f"from {first:%Y-%m-%d} to {last:%Y-%m-%d}, and today is {at:%Y-%m-%d}; nothing was signed; "
                "name a valid certificate"
            )

    def sign(self, data: bytes) -> bytes:
        """Return the signature over the hash of `data`: PKCS#1 v1.5, or ECDSA in DER form.

        Raises BadInput where the token does not sign, or the key is not that of the certificate.
        """
        signature = self._sign(data)
        if not fits(_public(self.certificate, self.where), self.digest, signature, data):
            raise BadInput(_mismatch(self.where, self.signatory))
        return signature


def signatory_of(certificate: x509.Certificate) -> Signatory:
    """Return the subject of a certificate as a signatory."""

    return Signatory(
        subject=certificate.subject.rfc4514_string(),
        issuer=certificate.issuer.rfc4514_string(),
        fingerprint=hashlib.sha256(certificate.public_bytes(Encoding.DER)).hexdigest(),
    )


def digest_of(public: PublicKey) -> Digest:
    """Return the hash for a key: SHA-384 for P-384, else SHA-256."""
    return "sha384" if getattr(getattr(public, "curve", None), "name", "") == "secp384r1" else "sha256"


def fits(public: PublicKey, digest: Digest, signature: bytes, data: bytes) -> bool:
    """Return whether a signature over `data` is by this key."""

    try:
        if isinstance(public, RSAPublicKey):
            public.verify(signature, data, PKCS1v15(), _hash(digest))
        else:
            public.verify(signature, data, ECDSA(_hash(digest)))
    except (InvalidSignature, ValueError):
        return False
    return True


def open_signing_key(settings: SigningSettings) -> SigningKey:
    """Open the key that the settings name. Raises BadInput, which names the file and what to do."""
    if settings.key.startswith(SCHEME):
        return _of_token(token_uri(settings.key, SIGNING_KEY), settings)
    return _of_file(Path(settings.key), settings)


def _of_file(path: Path, settings: SigningSettings) -> SigningKey:

    place_text = f"signing key {path}"
    refuse_open_key(path, SIGNING_KEY)
    password = read_secret(Path(settings.password_file), PASSWORD_FILE).encode() if settings.password_file else None
    content = path.read_bytes()
    key, beside = (_pem if b"-----BEGIN" in content else _pkcs12)(content, password, place_text)
    if not isinstance(key, RSAPrivateKey | EllipticCurvePrivateKey):
        raise _unused(place_text)
    certificates = read_certificates(Path(settings.certificate)) if settings.certificate else beside
    certificate, chain = _own(certificates, key.public_key(), place_text)
    digest = digest_of(_public(certificate, place_text))

    def sign(data: bytes) -> bytes:
        if isinstance(key, RSAPrivateKey):
            return key.sign(data, PKCS1v15(), _hash(digest))
        return key.sign(data, ECDSA(_hash(digest)))

    return SigningKey(place_text, certificate, chain, sign)


def _pem(content: bytes, password: bytes | None, location: str) -> tuple[object, list[x509.Certificate]]:

    try:
        key = load_pem_private_key(content, password if b"ENCRYPTED" in content else None)
    except (ValueError, TypeError) as error:
        raise _unreadable(location, password, encrypted=b"ENCRYPTED" in content) from error
    return key, x509.load_pem_x509_certificates(content) if b"-----BEGIN CERTIFICATE" in content else []


def _pkcs12(content: bytes, password: bytes | None, location: str) -> tuple[object, list[x509.Certificate]]:

    try:
        key, certificate, more = load_key_and_certificates(content, password)
    except ValueError as error:
        is_der = content[:1] == b"\x30"
        raise _unreadable(location, password, encrypted=is_der) from error
    return key, [*([certificate] if certificate else []), *more]


def _unreadable(location: str, password: bytes | None, *, encrypted: bool) -> BadInput:
    if not encrypted:
        return BadInput(f"{location}: this is no private key in PEM form or PKCS#12; name such a file")
    if password is None:
        return BadInput(
            f"{location}: it needs a password; write it into a file with mode 0600, and name that by "
            f"{SIGN_PASSWORD_VARIABLE}"
        )
    return BadInput(
        f"{location}: the password in the file that {SIGN_PASSWORD_VARIABLE} names does not open it; correct the "
        "password"
    )


def _unused(location: str) -> BadInput:
    return BadInput(
        f"{location}: this kind of key is not used; give an RSA key of {RSA_BITS} bits or more, or an ECDSA key on "
        "P-256 "
        "or P-384"
    )


def _of_token(uri: TokenUri, settings: SigningSettings) -> SigningKey:
    from pkcs11 import Attribute, ObjectClass  # noqa: PLC0415  only where a token is used
    from pkcs11.exceptions import PKCS11Error  # noqa: PLC0415  as above

    place_text = f"signing key {uri.named}"
    try:
        session = open_session(uri)
        key = session.get_key(object_class=ObjectClass.PRIVATE_KEY, label=uri.object)
        certificates = session.get_objects({Attribute.CLASS: ObjectClass.CERTIFICATE, Attribute.LABEL: uri.object})
        token_certificates = [
            x509.load_der_x509_certificate(certificate[Attribute.VALUE]) for certificate in certificates
        ]
    except (PKCS11Error, RuntimeError, KeyError, OSError, ValueError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise BadInput(f"{place_text}: {reason}; check token, object, module and PIN") from error
    own_certificates = read_certificates(Path(settings.certificate)) if settings.certificate else token_certificates
    if not own_certificates:
        raise BadInput(
            f"{place_text}: the token holds no certificate of it; name a PEM file by {SIGN_CERTIFICATE_VARIABLE}"
        )
    digest = digest_of(_public(own_certificates[0], place_text))

    def sign(data: bytes) -> bytes:
        try:
            return _signed_by_token(key, digest, data)
        except PKCS11Error as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise BadInput(f"{place_text}: {reason}; nothing was signed; check the token") from error

    return SigningKey(place_text, own_certificates[0], tuple(own_certificates[1:]), sign, session.close)


def _signed_by_token(key: Any, digest: Digest, data: bytes) -> bytes:
    """Return a signature by a key of python-pkcs11; the r and s of ECDSA, which a token puts side by side, as DER."""
    from pkcs11 import KeyType, Mechanism  # noqa: PLC0415  as above

    if key.key_type == KeyType.RSA:
        return bytes(key.sign(data, mechanism=Mechanism.SHA256_RSA_PKCS))
    signature = bytes(key.sign(hashlib.new(digest, data).digest(), mechanism=Mechanism.ECDSA))
    half = len(signature) // 2
    return encode_dss_signature(int.from_bytes(signature[:half], "big"), int.from_bytes(signature[half:], "big"))


def read_certificates(path: Path) -> list[x509.Certificate]:
    """Read one or more certificates in PEM form. Raises BadInput."""

    try:
        return x509.load_pem_x509_certificates(path.read_bytes())
    except OSError as error:
        raise BadInput(f"certificate {path}: {error.strerror}; name a PEM file with certificates") from error
    except ValueError as error:
        raise BadInput(f"certificate {path}: this is no certificate in PEM form; name a PEM file") from error


def _own(
    certificates: Sequence[x509.Certificate], public: object, location: str
) -> tuple[x509.Certificate, tuple[x509.Certificate, ...]]:
    """Return the certificate of a public key, and the others. Raises BadInput where none is."""
    if not certificates:
        raise BadInput(f"{location}: it holds no certificate; name a PEM file with it by {SIGN_CERTIFICATE_VARIABLE}")
    matching = next((certificate for certificate in certificates if certificate.public_key() == public), None)
    if matching is None:
        raise BadInput(_mismatch(location, signatory_of(certificates[0])))
    _public(matching, location)
    return matching, tuple(certificate for certificate in certificates if certificate is not matching)


def _mismatch(location: str, signatory: Signatory) -> str:
    return (
        f"{location}: the key is not that of the certificate ({signatory.subject}); nothing was signed; name the "
        f"certificate of this key by {SIGN_CERTIFICATE_VARIABLE}, or the key of this certificate by {SIGN_KEY_VARIABLE}"
    )


def _public(certificate: x509.Certificate, location: str) -> PublicKey:
    """Return the public key of a certificate that may sign documents. Raises BadInput."""

    public = certificate.public_key()
    is_rsa = isinstance(public, RSAPublicKey) and public.key_size >= RSA_BITS
    is_ec = isinstance(public, EllipticCurvePublicKey) and public.curve.name in ("secp256r1", "secp384r1")
    if not isinstance(public, RSAPublicKey | EllipticCurvePublicKey) or not (is_rsa or is_ec):
        raise _unused(location)
    try:
        usage = certificate.extensions.get_extension_for_class(x509.KeyUsage).value
    except x509.ExtensionNotFound:
        return public
    if not (usage.digital_signature or usage.content_commitment):
        raise BadInput(
            f"{location}: its certificate ({certificate.subject.rfc4514_string()}) is not for signatures (key usage); "
            "name one with digitalSignature or nonRepudiation"
        )
    return public


def _hash(digest: Digest) -> Any:

    return hashes.SHA384() if digest == "sha384" else hashes.SHA256()
