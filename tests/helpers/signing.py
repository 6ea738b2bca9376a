"""Keys and certificates (X.509) for signed certificates, made when a test needs them; signatures checked by hand."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import xmlsec
from asn1crypto import cms, tsp
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, padding, rsa
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    NoEncryption,
    PrivateFormat,
)
from cryptography.hazmat.primitives.serialization.pkcs12 import serialize_key_and_certificates
from cryptography.x509.oid import NameOID
from lxml import etree

#: When certificates of tests are issued (tests.helpers.certificates.AT).
AT = datetime(2027, 3, 1, 12, tzinfo=UTC)
KINDS = ("p256", "p384", "rsa2048")
Key = Any
#: Adds attributes to asn1crypto.cms, which pyHanko needs; they cannot be added after the first use.
ATTRIBUTES = tsp.CMSAttributeType


def new_key(kind: str) -> Key:
    """Make a private key."""
    made = {
        "p256": lambda: ec.generate_private_key(ec.SECP256R1()),
        "p384": lambda: ec.generate_private_key(ec.SECP384R1()),
        "p521": lambda: ec.generate_private_key(ec.SECP521R1()),
        "rsa2048": lambda: rsa.generate_private_key(65537, 2048),
        "rsa1024": lambda: rsa.generate_private_key(65537, 1024),
        "ed25519": ed25519.Ed25519PrivateKey.generate,
    }
    return made[kind]()


@dataclass(frozen=True)
class Owner:
    """A private key and the certificate of its public key."""

    key: Key
    certificate: x509.Certificate

    @property
    def pem(self) -> bytes:
        """The certificate in PEM form."""
        return self.certificate.public_bytes(Encoding.PEM)

    def key_pem(self, password: bytes | None = None) -> bytes:
        """Return the private key in PEM form."""
        closed = BestAvailableEncryption(password) if password else NoEncryption()
        made: bytes = self.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, closed)
        return made

    def pkcs12(self, password: bytes | None, chain: tuple[x509.Certificate, ...] = ()) -> bytes:
        """Return key and certificates as PKCS#12."""
        closed = BestAvailableEncryption(password) if password else NoEncryption()
        return serialize_key_and_certificates(b"lab", self.key, self.certificate, chain, closed)


def owner(
    name: str,
    kind: str = "p256",
    issuer: Owner | None = None,
    *,
    days: tuple[float, float] = (-1, 365),
    signs: bool = True,
    authority: bool = False,
    public_key: Key = None,
) -> Owner:
    """Make a key and its certificate, valid from `days[0]` to `days[1]` after AT; self-signed without an issuer."""
    key = new_key(kind)
    subject = x509.Name(
        [x509.NameAttribute(NameOID.ORGANIZATION_NAME, "Lab & Sons"), x509.NameAttribute(NameOID.COMMON_NAME, name)]
    )
    usage = x509.KeyUsage(signs, signs, not signs, False, False, authority, authority, False, False)
    signer = issuer.key if issuer else key
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer.certificate.subject if issuer else subject)
        .public_key(public_key or key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(AT + timedelta(days=days[0]))
        .not_valid_after(AT + timedelta(days=days[1]))
        .add_extension(x509.BasicConstraints(authority, None), critical=True)
        .add_extension(usage, critical=True)
        .sign(signer, None if isinstance(signer, ed25519.Ed25519PrivateKey) else hashes.SHA256())
    )
    return Owner(key, made)


def private_file(path: Path, content: bytes) -> Path:
    """Write a file that only its owner can read."""
    path.write_bytes(content)
    path.chmod(0o600)
    return path


def key_file(folder: Path, signer: Owner, name: str = "key.pem") -> Path:
    """Write key and certificate into one private PEM file."""
    return private_file(folder / name, signer.key_pem() + signer.pem)


def xml_verifies(xml: bytes, certificate: x509.Certificate) -> bool:
    """Return what the C library xmlsec finds of the signature of a DCC."""
    root = etree.fromstring(xml)
    xmlsec.tree.add_ids(root, ["Id"])
    context = xmlsec.SignatureContext()
    context.key = xmlsec.Key.from_memory(certificate.public_bytes(Encoding.PEM), xmlsec.constants.KeyDataFormatCertPem)
    try:
        context.verify(root.find(f"{{{xmlsec.constants.DSigNs}}}Signature"))
    except xmlsec.Error:
        return False
    return True


def pdf_verifies(pdf: bytes, certificate: x509.Certificate) -> bool:
    """Return whether the signature of a PDF is over all of it, by hand: ISO 32000-1, 12.8.1, and RFC 5652, 5.4."""
    (span,) = re.findall(rb"/ByteRange \[(\d+) (\d+) (\d+) (\d+)\]", pdf)
    first, length, second, rest = map(int, span)
    if first or second + rest != len(pdf):
        return False
    signed = pdf[first : first + length] + pdf[second:]
    content = bytes.fromhex(pdf[first + length + 1 : second - 1].decode())
    (info,) = cms.ContentInfo.load(content)["content"]["signer_infos"]
    attributes = {each["type"].native: each["values"][0].native for each in info["signed_attrs"]}
    digest = info["digest_algorithm"]["algorithm"].native
    if attributes["message_digest"] != hashlib.new(digest, signed).digest():
        return False
    public: Any = certificate.public_key()
    algorithm = {"sha256": hashes.SHA256(), "sha384": hashes.SHA384()}[digest]
    how = (padding.PKCS1v15(), algorithm) if isinstance(public, rsa.RSAPublicKey) else (ec.ECDSA(algorithm),)
    try:
        public.verify(info["signature"].native, info["signed_attrs"].untag().dump(), *how)
    except InvalidSignature:
        return False
    return True
