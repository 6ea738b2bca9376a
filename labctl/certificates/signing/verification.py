"""Verification of signed certificates: is each signature over these bytes, by whom, and is the signer trusted.

There is no time stamp of a third party in a signature (level B-B): the time of it is what the signer states.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from io import BytesIO
from typing import Any, Literal

from asn1crypto import x509 as asn1
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from lxml import etree
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.validation.generic_cms import validate_sig_integrity
from pyhanko.sign.validation.pdf_embedded import EmbeddedPdfSignature
from pyhanko.sign.validation.status import SignatureCoverageLevel
from pyhanko_certvalidator import CertificateValidator
from pyhanko_certvalidator.context import ValidationContext
from pyhanko_certvalidator.errors import PathBuildingError, PathError, ValidationError
from signxml.exceptions import SignXMLException
from signxml.xades.xades import XAdESSignatureConfiguration, XAdESVerifier, XAdESVerifyResult

from labctl.certificates.document import Signatory
from labctl.certificates.signing.keys import signatory_of
from labctl.certificates.signing.own_thread import in_own_thread
from labctl.certificates.signing.xades import XADES
from labctl.errors import BadInput

DS = "http://www.w3.org/2000/09/xmldsig#"
Trust = Literal["trusted", "not trusted", "not established"]


@dataclass(frozen=True)
class SignatureFound:
    """A signature of a certificate's file."""

    form: Literal["PAdES", "XAdES"]
    valid: bool = False  #: the signature is over these bytes, by the key of the certificate (X.509) that it holds
    problem: str = ""  #: why it is not valid
    signatory: Signatory | None = None  #: None: the certificate cannot be read
    signed_at: datetime | None = None  #: as the signer states
    trust: Trust = "not established"
    reason: str = ""  #: of the trust


def signatures_of_dcc(xml: bytes, roots: Sequence[x509.Certificate] | None) -> list[SignatureFound]:
    """Return what is found of each signature of a DCC; `roots`: the authorities that are trusted, None: none is named.

    Raises BadInput for a file that is no XML.
    """
    try:
        root = etree.fromstring(xml, etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as error:
        raise BadInput(f"this is no XML ({error}); give the file as it was issued") from error
    count = len(root.findall(f"{{{DS}}}Signature"))
    if count > 1:
        return [SignatureFound("XAdES", problem=f"it has {count} signatures, and labctl makes one")]
    return [_xades(root, xml, roots)] if count else []


def _xades(root: Any, xml: bytes, roots: Sequence[x509.Certificate] | None) -> SignatureFound:
    try:
        texts = [each.text for each in root.findall(f"{{{DS}}}Signature//{{{DS}}}X509Certificate")]
        certificate, *chain = [x509.load_pem_x509_certificate(_pem(text)) for text in texts]
    except (ValueError, TypeError) as error:
        return SignatureFound("XAdES", problem=f"its certificate cannot be read: {error}")
    signature = SignatureFound("XAdES", signatory=signatory_of(certificate))
    try:
        stated = datetime.fromisoformat(root.findtext(f"{{{DS}}}Signature//{{{XADES}}}SigningTime"))
        config = XAdESSignatureConfiguration(location="./", verification_time=stated)
        results = XAdESVerifier().verify(xml, x509_cert=certificate, expect_config=config)
    except (SignXMLException, ValueError, TypeError, etree.LxmlError) as error:
        return replace(signature, problem=" ".join(str(error).split()) or type(error).__name__)
    if not any(result.signed_xml is not None and result.signed_xml.tag == root.tag for result in results):
        return replace(signature, problem="the signature is not over the whole certificate")
    (signed,) = [result for result in results if isinstance(result, XAdESVerifyResult)]
    at = datetime.fromisoformat(signed.signed_properties.findtext(f"{{{XADES}}}SigningTime"))
    return _with_trust(replace(signature, valid=True, signed_at=at), at, certificate, chain, roots)


def _pem(text: str) -> bytes:
    lines = "".join(text.split())
    return f"-----BEGIN CERTIFICATE-----\n{lines}\n-----END CERTIFICATE-----\n".encode()


def signatures_of_pdf(pdf: bytes, roots: Sequence[x509.Certificate] | None) -> list[SignatureFound]:
    """Return what is found of each signature of a PDF, then of the DCC that is attached to it; `roots` as above.

    Raises BadInput for a file that is no PDF.
    """
    try:
        reader = PdfFileReader(BytesIO(pdf))
        embedded, attached = reader.embedded_signatures, list(_attached(reader))
    except Exception as error:  # a damaged file makes the reader raise errors of many kinds
        raise BadInput(f"this PDF cannot be read ({error}); give the file as it was issued") from error
    signatures = [_pades(each, roots) for each in embedded]
    for xml in attached:
        signatures += signatures_of_dcc(xml, roots)
    return signatures


def _attached(reader: PdfFileReader) -> Iterator[bytes]:
    for each in reader.root.get("/AF", ()):
        yield each.get_object()["/EF"]["/F"].data


def _pades(signature: EmbeddedPdfSignature, roots: Sequence[x509.Certificate] | None) -> SignatureFound:
    certificate, *chain = [
        x509.load_der_x509_certificate(other_embedded_cert.dump())
        for other_embedded_cert in (signature.signer_cert, *signature.other_embedded_certs)
    ]
    at = signature.self_reported_timestamp
    pades_signature = SignatureFound("PAdES", signatory=signatory_of(certificate), signed_at=at)
    try:
        intact, by_key = validate_sig_integrity(
            signature.signer_info, signature.signer_cert, "data", signature.compute_digest()
        )
        covered = signature.evaluate_signature_coverage()
    except Exception as error:  # noqa: BLE001  as above
        return replace(pades_signature, problem=" ".join(str(error).split()) or type(error).__name__)
    if not by_key:
        return replace(pades_signature, problem="it is not by the key of its certificate")
    if not intact:
        return replace(pades_signature, problem="the file was changed after it was signed")
    if covered is not SignatureCoverageLevel.ENTIRE_FILE:
        return replace(pades_signature, problem="something was added to the file after it was signed")
    first, last = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if at is None or not first <= at <= last:
        return replace(
            pades_signature, problem=f"its certificate is valid from {first:%Y-%m-%d} to {last:%Y-%m-%d} only"
        )
    return _with_trust(replace(pades_signature, valid=True), at, certificate, chain, roots)


def _with_trust(
    signature: SignatureFound,
    at: datetime,
    certificate: x509.Certificate,
    chain: Sequence[x509.Certificate],
    roots: Sequence[x509.Certificate] | None,
) -> SignatureFound:
    """Return a valid signature with whether an authority that is trusted vouches for the signer at the time `at`."""
    if roots is None:
        issuer_text = (
            "self-signed"
            if certificate.issuer == certificate.subject
            else f"issued by {certificate.issuer.rfc4514_string()}"
        )
        return replace(
            signature, reason=f"{issuer_text}: trust not established; name the file of a trusted authority by --ca"
        )
    context = ValidationContext(trust_roots=[_asn1(root) for root in roots], allow_fetching=False, moment=at)
    validator = CertificateValidator(_asn1(certificate), [_asn1(each) for each in chain], validation_context=context)
    try:
        in_own_thread(lambda: asyncio.run(validator.async_validate_path()))
    except (PathBuildingError, PathError, ValidationError) as error:
        return replace(signature, trust="not trusted", reason=" ".join(str(error).split()))
    return replace(
        signature, trust="trusted", reason=f"issued by {certificate.issuer.rfc4514_string()}, valid on {at:%Y-%m-%d}"
    )


def _asn1(certificate: x509.Certificate) -> Any:
    return asn1.Certificate.load(certificate.public_bytes(Encoding.DER))
