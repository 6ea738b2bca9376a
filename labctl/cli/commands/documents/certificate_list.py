"""`labctl certificates`: list the certificates of a unit; verify the file of one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.default_command import GroupWithList
from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Serial
from labctl.cli.output import console, print_json

if TYPE_CHECKING:
    from labctl.services.schemas.documents.signatures import SignatureResponse, VerifiedFileResponse

app = typer.Typer(
    cls=GroupWithList,
    no_args_is_help=True,
    help="List the certificates of a unit (labctl certificates SERIAL), or verify the file of a certificate.",
)
REGISTER = {
    "same": "as it was issued, byte for byte",
    "differs": "not as it was issued: the bytes of the file differ",
    "unknown": "not in the register of this database",
}


@app.command("list")
def certificates(serial: Serial, as_json: Json = False, database: Database = None) -> None:
    """List the certificates of a unit, newest first, with the state of each: valid, amended, superseded, withdrawn."""
    from labctl.cli.printing.certificates import list_line
    from labctl.services.certificates.states import list_certificates
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        rows = list_certificates(store, serial)
    if as_json:
        print_json(rows)
        return
    for row in rows:
        console.print(list_line(row), soft_wrap=True)


@app.command("verify")
def verify(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="PDF, DCC (XML) or JSON file of a certificate.")],
    ca: Annotated[
        Path | None,
        typer.Option(
            "--ca",
            metavar="CA.pem",
            help="File with the certificates (X.509, PEM) of the authorities that you trust; without it the "
            "signatures are verified, but not who the signer is.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Verify the file of a certificate: whether it is as it was issued, and its signatures.

    Exit status 1 when the file differs from the one that was issued, a signature is not valid or not trusted,
    or neither the register nor a trusted signature confirms the file.
    """
    from labctl.services.certificates.verification import verify_file
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = verify_file(store, file, ca)
    if as_json:
        print_json(answer)
    else:
        _print(file, answer)
    raise typer.Exit(0 if answer.ok else 1)


def _print(file: Path, answer: VerifiedFileResponse) -> None:
    from labctl.cli.printing.certificates import state_text

    number = f"certificate {answer.number}" if answer.number else "a file without a certificate's number"
    console.print(f"{file}: {number}, {REGISTER[answer.in_register]}", soft_wrap=True)
    if answer.certificate is not None and answer.certificate.state != "valid":
        console.print(state_text(answer.certificate), soft_wrap=True)
    for each in answer.signatures:
        console.print(_signature(each), soft_wrap=True)
    if not answer.signatures:
        console.print("no signature", soft_wrap=True)


def _signature(found: SignatureResponse) -> str:
    signer = "" if found.signed_by is None else f" by {found.signed_by.subject} ({found.signed_by.fingerprint[:16]})"
    if not found.valid:
        return f"{found.form} signature{signer}: NOT VALID: {found.problem}"
    at = "" if found.signed_at is None else f", {found.signed_at:%Y-%m-%d %H:%M} UTC as the signer states"
    trust = found.reason if found.trust == "not established" else f"{found.trust}: {found.reason}"
    return f"{found.form} signature{signer}: valid{at}; {trust}"
