"""The signature of a certificate when it is issued, by the key that the environment names; without one, none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import datetime
from typing import TYPE_CHECKING

from labctl.answers.signatures import SigningKeyResponse
from labctl.certificates.dcc import dcc_of
from labctl.certificates.document import Certificate
from labctl.certificates.pdf import pdf_of
from labctl.certificates.signing import SigningSettings, libraries, signing_settings
from labctl.config import SIGN_KEY_VARIABLE
from labctl.errors import BadInput
from labctl.store import CertificateForms

if TYPE_CHECKING:
    from labctl.certificates.signing.keys import SigningKey


@contextmanager
def signing_key(at: datetime) -> Iterator[SigningKey | None]:
    """Open the key that signs certificates at an aware time for a while; None where none is set.

    Raises BadInput, which names the file or token, what is wrong with it, and what to do.
    """
    key_settings = signing_settings()
    if not key_settings.key:
        yield None
        return
    with closing(_opened(key_settings)) as key:
        key.refuse_outside_validity(at)
        yield key


def _opened(settings: SigningSettings) -> SigningKey:
    with libraries("signing"):
        from labctl.certificates.signing.keys import open_signing_key  # noqa: PLC0415  only where a key is set

        return open_signing_key(settings)


def show_signing_key() -> SigningKeyResponse:
    """Return whose the signing key is, and how long it may sign. Raises BadInput."""
    key_settings = signing_settings()
    if not key_settings.key:
        raise BadInput(
            f"{SIGN_KEY_VARIABLE} is not set; name the signing key by it: a PEM or PKCS#12 file with key and "
            "certificate, or a PKCS#11 URI"
        )
    with closing(_opened(key_settings)) as key:
        return SigningKeyResponse(
            **key.signatory.model_dump(),
            valid_from=key.certificate.not_valid_before_utc,
            valid_until=key.certificate.not_valid_after_utc,
            digest=key.digest,
        )


def to_be_signed(certificate: Certificate, key: SigningKey | None) -> Certificate:
    """Return the certificate with the name of its signer; as it is without a key."""
    return certificate if key is None else certificate.model_copy(update={"signed_by": key.signatory})


def forms_of(certificate: Certificate, key: SigningKey | None, at: datetime) -> CertificateForms:
    """Return a certificate in its three forms, XML and PDF signed at an aware time where there is a key.

    The XML that is attached to the PDF is the signed one. Raises BadInput.
    """
    document, xml = certificate.to_bytes(), dcc_of(certificate)
    if key is None:
        return CertificateForms(document, xml, pdf_of(certificate, xml))
    with libraries("signing"):
        from labctl.certificates.signing.pades import sign_pdf  # noqa: PLC0415  as above
        from labctl.certificates.signing.xades import sign_dcc  # noqa: PLC0415  as above
    signed = sign_dcc(xml, key, at)
    return CertificateForms(document, signed, sign_pdf(pdf_of(certificate, signed), key, at))
