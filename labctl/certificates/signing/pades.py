"""The signature of a PDF: PAdES B-B (ETSI EN 319 142-1), appended; pages, metadata and attachment stay as they were."""

from __future__ import annotations

from datetime import datetime
from io import BytesIO
from typing import Any

from asn1crypto.x509 import Certificate
from cryptography.hazmat.primitives.serialization import Encoding
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
from pyhanko.sign.fields import SigSeedSubFilter
from pyhanko.sign.signers import PdfSignatureMetadata, PdfSigner, Signer
from pyhanko.sign.signers.constants import ESIC_EXTENSION_1
from pyhanko_certvalidator.registry import SimpleCertificateStore

from labctl.certificates.signing.keys import SigningKey
from labctl.certificates.signing.own_thread import in_own_thread

#: Name of the field in the form of the PDF. It has no place on a page: the pages say in words who signs.
FIELD = "Signature"
REASON = "Issue of the calibration certificate"
#: Room for a signature by any permitted key, byte.
SIGNATURE_BYTES = 1024


def sign_pdf(pdf: bytes, key: SigningKey, at: datetime) -> bytes:
    """Return the PDF with its signature; `at` is the time of it, aware. Raises BadInput where the key does not sign."""
    writer = _Writer(BytesIO(pdf))
    meta = PdfSignatureMetadata(
        field_name=FIELD, md_algorithm=key.digest, subfilter=SigSeedSubFilter.PADES, reason=REASON
    )
    signer = _PdfSigner(meta, _CmsSigner(key), at)
    return bytes(in_own_thread(lambda: signer.sign_pdf(writer)).getbuffer())


class _Writer(IncrementalPdfFileWriter):
    """Appends to a PDF and leaves its metadata as they are; the library would write the system's time into them."""

    def _update_meta(self) -> None:
        pass


class _CmsSigner(Signer):
    """A signing key as pyHanko uses one."""

    def __init__(self, key: SigningKey) -> None:
        certificate, *chain = [
            Certificate.load(each.public_bytes(Encoding.DER)) for each in (key.certificate, *key.chain)
        ]
        registry = SimpleCertificateStore()  # type: ignore[no-untyped-call]
        registry.register_multiple([certificate, *chain])
        super().__init__(signing_cert=certificate, cert_registry=registry)
        self._key = key

    async def async_sign_raw(self, data: bytes, digest_algorithm: str, dry_run: bool = False) -> bytes:  # noqa: ARG002
        return bytes(SIGNATURE_BYTES) if dry_run else self._key.sign(data)


class _PdfSigner(PdfSigner):
    """Signs at a time that is given, and leaves the PDF one of version 1.7, on which PDF/A-3 is based."""

    def __init__(self, meta: PdfSignatureMetadata, signer: Signer, at: datetime) -> None:
        super().__init__(meta, signer=signer)
        self._at = at

    def register_extensions(self, pdf_out: Any, *, md_algorithm: str) -> None:  # noqa: ARG002
        pdf_out.register_extension(ESIC_EXTENSION_1)

    def init_signing_session(self, pdf_out: Any, existing_fields_only: bool = False) -> Any:
        session = super().init_signing_session(pdf_out, existing_fields_only)
        session.system_time = self._at
        return session
