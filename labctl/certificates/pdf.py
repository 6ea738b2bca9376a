"""A certificate as PDF/A-3a by typst, with its DCC attached; the same bytes every time."""

from __future__ import annotations

from datetime import UTC, datetime, time
from importlib import resources
from io import BytesIO
from typing import TYPE_CHECKING, cast

from labctl.certificates.document import Certificate
from labctl.certificates.readable import readable_certificate
from labctl.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Callable

#: PDF/A-3, level A: tagged, and with fonts, colours and attachments as PDF/A-3b asks.
STANDARD = "a-3a"
#: Error correction of the QR code: a quarter of it may be damaged.
CORRECTION = "q"


def pdf_of(certificate: Certificate, xml: bytes) -> bytes:
    """Return the PDF with `xml` attached. Raises BadInput for a text that the fonts cannot show."""
    import typst  # noqa: PLC0415  both libraries take a tenth of a second, which only this function needs

    #: It takes a project as a dictionary of files too, which its types leave out.
    compiled = cast("Callable[..., bytes | list[bytes] | None]", typst.compile)
    template = resources.files("labctl.certificates").joinpath("template.typ").read_bytes()
    files = {
        "main.typ": template,
        "certificate.json": readable_certificate(certificate),
        "dcc.xml": xml,
        "qr.svg": _qr(certificate.state_address or certificate.calibration.address),
    }
    issued = datetime.combine(certificate.issued_on, time(), UTC)
    try:
        content = compiled(files, ignore_system_fonts=True, pdf_standards=[STANDARD], timestamp=issued)
    except typst.TypstError as error:
        raise BadInput(
            f"certificate {certificate.number} cannot be printed: {error.message}; use Latin, Greek or Cyrillic "
            "letters "
            "in the names and texts of the order"
        ) from error
    if not isinstance(content, bytes):
        raise TypeError(f"typst answered {type(content).__name__} instead of the bytes of one PDF")
    return content


def _qr(address: str) -> bytes:
    import segno  # noqa: PLC0415  as above

    drawn = BytesIO()
    segno.make(address, error=CORRECTION, micro=False).save(drawn, kind="svg", border=2, xmldecl=False, svgns=True)
    return drawn.getvalue()
