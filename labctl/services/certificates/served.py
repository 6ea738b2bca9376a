"""Certificates as files, as they were issued."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from labctl.errors import BadInput, NotFound
from labctl.services.certificates.issue import response
from labctl.services.schemas.documents.certificates import CertificateResponse
from labctl.services.standards.usage import Notices
from labctl.store import Store

CertificateFormat = Literal["pdf", "xml", "json"]
MEDIA_TYPES = {"pdf": "application/pdf", "xml": "application/xml", "json": "application/json"}


@dataclass(frozen=True)
class CertificateFile:
    """One form of a certificate."""

    content: bytes
    media_type: str
    name: str
    etag: str  #: hash of the certificate's JSON, and the format


def format_of(name: str) -> CertificateFormat:
    """Return the format that a suffix names, with or without its dot. Raises BadInput."""
    for known in get_args(CertificateFormat):
        if name.lower().removeprefix(".") == known:
            return known
    raise BadInput(f"{name!r} is not a format of a certificate; give pdf, xml or json")


def certificate_file(
    store: Store, serial: str, version: int, format_name: str, number: str | None = None
) -> CertificateFile:
    """Return a form of the certificate of a version, by its number also one that was replaced. Raises NotFound."""
    chosen = format_of(format_name)
    rows = [row for row in store.certificates.of_unit(store.units.get(serial).serial) if row.version == version]
    found = next((row for row in rows if number in (None, row.number)), None)
    if found is None:
        store.calibrations.get(serial, version)
        raise NotFound(
            f"{serial} version {version} has no certificate{f' {number}' if number else ''}; `labctl certificate "
            f"{serial} --version {version} --order ORDER.toml --by NAME --out FILE.pdf` issues it"
        )
    forms = store.certificates.forms(found.number)
    content = {"pdf": forms.pdf, "xml": forms.xml, "json": forms.document}[chosen]
    plain = "".join(char if char.isalnum() or char in "._-" else "_" for char in found.number)
    return CertificateFile(content, MEDIA_TYPES[chosen], f"{plain}.{chosen}", f"{found.hash}-{chosen}")


def list_certificates(store: Store, serial: str) -> list[CertificateResponse]:
    """Return every certificate of a unit, newest first. Raises NotFound."""
    rows = store.certificates.of_unit(store.units.get(serial).serial)
    by = {row.replaces: row.number for row in rows if row.replaces}
    notices = Notices.of(store)
    behind = {row.version: row.recordings for row in store.calibrations.of_unit(serial)} if notices.bad else {}
    return [response(row, by.get(row.number), notices.of_recordings(behind.get(row.version, ()))) for row in rows]
