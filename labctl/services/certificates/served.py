"""Certificates as files, as they were issued."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal, get_args

from labctl.answers.certificates import CertificateResponse, PublicCertificate
from labctl.errors import BadInput, NotFound
from labctl.services.certificates.address import HASH_DIGITS
from labctl.services.certificates.states import certificate_by_number, list_certificates
from labctl.services.standards.usage import Notices
from labctl.store import Store
from labctl.withdrawal import HEADER, Withdrawn

CertificateFormat = Literal["pdf", "xml", "json"]
MEDIA_TYPES = {"pdf": "application/pdf", "xml": "application/xml", "json": "application/json"}


@dataclass(frozen=True)
class CertificateFile:
    """One form of a certificate."""

    content: bytes
    media_type: str
    name: str
    etag: str  #: hash of the certificate's JSON, and the format
    issued: CertificateResponse  #: with its state

    def headers(self) -> dict[str, str]:
        """Return the HTTP headers beside the bytes: tag, name, and the state, which the bytes cannot say."""
        now = self.issued
        response_headers = {
            "ETag": f'"{self.etag}"', "Content-Disposition": f'inline; filename="{self.name}"',
            "Cache-Control": "no-cache", "X-Labctl-State": now.state,
        }  # fmt: skip
        if (withdrawn := notice_of(now)) is not None:
            response_headers[HEADER] = withdrawn.header()
        if now.valid_instead is not None:
            response_headers["X-Labctl-Replaced-By"] = now.valid_instead
        return response_headers


def notice_of(now: CertificateResponse) -> Withdrawn | None:
    """Return the notice of a certificate that is withdrawn; None for every other one."""
    if now.state != "withdrawn" or now.state_since is None:
        return None
    return Withdrawn(now.state_since, now.state_by, now.state_reason, now.number)


def format_of(name: str) -> CertificateFormat:
    """Return the format that a suffix names, with or without its dot. Raises BadInput."""
    for format_name in get_args(CertificateFormat):
        if name.lower().removeprefix(".") == format_name:
            return format_name
    raise BadInput(f"{name!r} is not a format of a certificate; give pdf, xml or json")


def certificate_file(
    store: Store, serial: str, version: int, format_name: str, number: str | None = None
) -> CertificateFile:
    """Return a form of the certificate of a version, by its number also one that was replaced. Raises NotFound."""
    chosen = format_of(format_name)
    rows = [row for row in list_certificates(store, serial) if row.version == version]
    certificate_row = next((row for row in rows if number in (None, row.number)), None)
    if certificate_row is None:
        store.calibrations.get(serial, version)
        raise NotFound(
            f"{serial} version {version} has no certificate{f' {number}' if number else ''}; `labctl certificate "
            f"{serial} --version {version} --order ORDER.toml --by NAME --out FILE.pdf` issues it"
        )
    forms = store.certificates.forms(certificate_row.number)
    content = {"pdf": forms.pdf, "xml": forms.xml, "json": forms.document}[chosen]
    plain = "".join(char if char.isalnum() or char in "._-" else "_" for char in certificate_row.number)
    return CertificateFile(
        content, MEDIA_TYPES[chosen], f"{plain}.{chosen}", f"{certificate_row.hash}-{chosen}", certificate_row
    )


def public_certificate(store: Store, number: str, calibration: str) -> PublicCertificate:
    """Return what every reader of a certificate may know, who has its number and the hash of the calibration on it.

    `calibration` is that hash or its beginning, at least `address.HASH_DIGITS` digits. Raises NotFound where number
    and hash are not those of one certificate.
    """
    none = NotFound(
        "this laboratory issued no certificate with this number and this hash of the calibration; compare both with "
        f"the paper (of the hash at least the first {HASH_DIGITS} digits)"
    )
    try:
        now = certificate_by_number(store, number)
    except NotFound:
        raise none from None
    _, hash_ = store.calibrations.document(now.serial, now.version)
    if len(calibration) < HASH_DIGITS or not hash_.startswith(calibration.lower()):
        raise none
    issued = json.loads(store.certificates.forms(number).document)
    public = now.model_dump(include=set(PublicCertificate.model_fields) - {"notices"})
    notices = Notices.of(store).for_customers(store.calibrations.get(now.serial, now.version).recordings)
    return PublicCertificate(**public, calibration_hash=hash_, laboratory=issued["laboratory"]["name"], notices=notices)
