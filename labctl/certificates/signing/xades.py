"""The signature of a DCC: XAdES-BES (ETSI EN 319 132-1, B-B), enveloped, the last element of the certificate."""

from __future__ import annotations

from datetime import datetime
from typing import Any, cast

from cryptography.hazmat.primitives.asymmetric.rsa import RSAPublicKey
from cryptography.hazmat.primitives.asymmetric.types import CertificatePublicKeyTypes
from lxml import etree
from signxml.algorithms import DigestAlgorithm, SignatureConstructionMethod, SignatureMethod
from signxml.xades.xades import XAdESDataObjectFormat, XAdESSigner

from labctl.certificates.signing.keys import SigningKey

XADES = "http://uri.etsi.org/01903/v1.3.2#"


def sign_dcc(xml: bytes, key: SigningKey, at: datetime) -> bytes:
    """Return the DCC with its signature; `at` is the time of it, aware. Raises BadInput where the key does not sign."""
    kind = "RSA" if isinstance(key.certificate.public_key(), RSAPublicKey) else "ECDSA"
    signer = XAdESSigner(
        method=SignatureConstructionMethod.enveloped,
        signature_algorithm=SignatureMethod[f"{kind}_{key.digest.upper()}"],
        digest_algorithm=DigestAlgorithm[key.digest.upper()],
        data_object_format=XAdESDataObjectFormat("Digital Calibration Certificate", "application/xml"),
    )

    def add_signing_time(properties: Any, *_: object, **__: object) -> None:
        signing_time = etree.SubElement(properties, f"{{{XADES}}}SigningTime", nsmap=signer.namespaces)
        signing_time.text = at.isoformat(timespec="seconds")

    annotators = cast("list[Any]", signer.signed_signature_properties_annotators)
    annotators[0] = add_signing_time  # that of the library reads the system's clock
    signed = signer.sign(
        etree.fromstring(xml),
        key=cast("Any", _XmlKey(key)),  # it has all of a key that the library uses
        cert=[key.certificate, *key.chain],
        always_add_key_value=False,
    )
    return etree.tostring(signed, encoding="utf-8", xml_declaration=True) + b"\n"


class _XmlKey:
    """A signing key as signxml uses one; the algorithm that it names is the key's own."""

    def __init__(self, key: SigningKey) -> None:
        self._key = key
        self.key_size: int = getattr(key.certificate.public_key(), "key_size", 0)

    def public_key(self) -> CertificatePublicKeyTypes:
        return self._key.certificate.public_key()

    def sign(self, data: bytes, **_: object) -> bytes:
        return self._key.sign(data)
