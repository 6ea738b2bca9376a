"""`labctl certificate`, `labctl certificates`: issue the certificate of a version, or write the one that was issued."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Serial
from labctl.cli.output import console, print_json

if TYPE_CHECKING:
    from labctl.services.schemas.documents.certificates import CertificateOrder

Order = Annotated[
    Path | None,
    typer.Option(
        "--order",
        metavar="ORDER.toml",
        help="File with the facts of the order: customer, item, method, conformity; with this option the "
        "certificate is issued.",
    ),
]
By = Annotated[
    str | None,
    typer.Option(
        "--by",
        metavar="NAME",
        help="Name of the person who issues the certificate; default: the user who is logged in.",
    ),
]
Amend = Annotated[
    str | None,
    typer.Option(
        "--amend",
        metavar="REASON",
        help="Replace the certificate that was issued, for this reason; the new certificate states the reason.",
    ),
]


def certificate(
    serial: Serial,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="FILE",
            help="Path of the file to write; its suffix (.pdf, .xml or .json) determines the format.",
        ),
    ],
    version: Annotated[
        int | None, typer.Option("--version", metavar="N", help="Calibration version; default: the certified version.")
    ] = None,
    order: Order = None,
    by: By = None,
    amend: Amend = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Issue the certificate of a version and write it as PDF/A-3, DCC (XML) or JSON.

    One that was issued is written again, byte for byte. Mandatory facts that are missing are named, and nothing is
    written.
    """
    from labctl.acting_user import actor
    from labctl.services.certificates.served import certificate_file, format_of
    from labctl.services.commands.open import execute, open_readonly
    from labctl.services.commands.registry import ISSUE_CERTIFICATE
    from labctl.services.commands.requests import ToVersion
    from labctl.services.schemas.documents.certificates import CertificateRequest

    with one_clear_line():
        chosen = format_of(out.suffix)
        with open_readonly(database) as store:
            number = store.calibrations.certified_version(serial) if version is None else version
        request = CertificateRequest(by=by or actor().name, order=read_order(order), amend=amend)
        answer = execute(database, ISSUE_CERTIFICATE, ToVersion(serial, number, request))
        with open_readonly(database) as store:
            out.write_bytes(certificate_file(store, serial, number, chosen, answer.number).content)
    if as_json:
        print_json(answer)
        return
    issued = f"issued {answer.issued_at:%Y-%m-%d} by {answer.by}"
    issued += f", replaces {answer.replaces}" if answer.replaces else ""
    console.print(f"certificate {answer.number} of {serial} version {number}, {issued} -> {out}")


def certificates(serial: Serial, as_json: Json = False, database: Database = None) -> None:
    """List the certificates of a unit, newest first, with what replaces them."""
    from labctl.services.certificates.served import list_certificates
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        rows = list_certificates(store, serial)
    if as_json:
        print_json(rows)
        return
    for row in rows:
        said = f"{row.number}  version {row.version}, issued {row.issued_at:%Y-%m-%d} by {row.by}"
        said += f", replaces {row.replaces}: {row.reason}" if row.replaces else ""
        said += f"; replaced by {row.replaced_by}" if row.replaced_by else ""
        console.print(said)


def read_order(path: Path | None) -> CertificateOrder:
    """Return the facts of an order file; none without a file. Raises BadInput naming the file, the key and why."""
    import tomllib

    from pydantic import ValidationError

    from instruments.toml_documents import listed, read_toml, shown
    from labctl.errors import BadInput
    from labctl.services.schemas.documents.certificates import CertificateOrder

    if path is None:
        return CertificateOrder()
    try:
        return CertificateOrder.model_validate(read_toml(path))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: not TOML ({error}); correct it") from error
    except ValidationError as error:
        said = listed(
            f"{'.'.join(map(str, each['loc']))} = {shown(each['input'])}: {each['msg']}" for each in error.errors()
        )
        raise BadInput(f"{path}: {said}; correct it (docs/how-to/certificates.md lists the keys)") from error
