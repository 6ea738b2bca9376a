"""Signatures of certificates: the key that signs, and what the verification of a file finds."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.certificates import CertificateResponse, CertificateState, SignatoryResponse


class SigningKeyResponse(SignatoryResponse):
    """The key that signs certificates; the private key is never shown."""

    valid_from: datetime = Field(description="First instant at which the key may sign.")
    valid_until: datetime = Field(description="Last instant at which the key may sign.")
    digest: Literal["sha256", "sha384"] = Field(description="Hash that is signed.")


class SignatureResponse(ResponseModel):
    """What is found of one signature of a file."""

    form: Literal["PAdES", "XAdES"] = Field(description="PAdES: of the PDF; XAdES: of the DCC.")
    valid: bool = Field(description="Whether the signature is over these bytes, by the key of its certificate (X.509).")
    problem: str = Field(description="Why the signature is not valid; empty: it is.")
    signed_by: SignatoryResponse | None = Field(description="Who signed; null: the certificate (X.509) is damaged.")
    signed_at: datetime | None = Field(description="Time of the signature, as the signer states it; null: not known.")
    trust: Literal["trusted", "not trusted", "not established"] = Field(
        description="Whether an authority that was named as trusted vouches for the signer; not established: none was."
    )
    reason: str = Field(description="Why the signer is trusted, or not.")
    expected: bool | None = Field(
        description="Whether the signer is one that is expected; null: none was named, so any signer was accepted."
    )


class VerifiedFileResponse(ResponseModel):
    """A file of a certificate, compared with the register of the database, and its signatures."""

    format: Literal["pdf", "xml", "json"] = Field(
        description="Form of the certificate that the file holds: PDF, XML (DCC) or JSON."
    )
    sha256: str = Field(description="SHA-256 of the file.")
    number: str | None = Field(description="Number of the certificate that the file states; null: none.")
    in_register: Literal["same", "differs", "unknown"] = Field(
        description="same: byte for byte as it was issued; differs: the certificate was issued with other bytes; "
        "unknown: the database has no certificate of this number."
    )
    certificate: CertificateResponse | None = Field(description="The certificate of this number in the database.")
    state: CertificateState | Literal["unknown"] = Field(
        description="State of the certificate; unknown: the database has no certificate of this number."
    )
    signed_by: SignatoryResponse | None = Field(
        description="Who signed the file: by the valid signature of the PDF or the DCC itself, of a JSON file by the "
        "register; null: no signature."
    )
    expected_signers: list[str] = Field(
        description="Signers that were named as expected: subjects or fingerprints; empty: any signer is accepted."
    )
    signatures: list[SignatureResponse] = Field(description="Each signature of the file; empty: it has none.")
    ok: bool = Field(
        description="Whether the file can be relied on: the register or a trusted signature confirms it, no check of "
        "it failed, an expected signer signed it if any is named, and the certificate is not withdrawn."
    )
