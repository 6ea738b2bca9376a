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
    from labctl.answers.signatures import SignatureResponse, VerifiedFileResponse

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
    from labctl.services.read_access import open_readonly

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
    signer: Annotated[
        list[str] | None,
        typer.Option(
            "--signer",
            metavar="SUBJECT|SHA256",
            help="Signer that you expect: attributes of the subject (CN=Ada Authoriser,O=Laboratory), or the SHA-256 "
            "of the certificate (X.509); give it several times for several persons; default: "
            "$LABCTL_EXPECTED_SIGNER, else every signer for whom an authority vouches.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Verify the file of a certificate: whether it is as it was issued, its signatures, and its state.

    Exit status 1 when the file differs from the one that was issued, a signature is not valid, not trusted or not
    by an expected signer, neither the register nor a trusted signature confirms the file, or the certificate was
    withdrawn. For an amended or superseded certificate the status is 0; the state is printed.
    """
    from labctl.services.certificates.verification import verify_file
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = verify_file(store, file, ca, signer or ())
    if as_json:
        print_json(answer)
    else:
        _print(file, answer)
    raise typer.Exit(0 if answer.ok else 1)


def _print(file: Path, answer: VerifiedFileResponse) -> None:
    from labctl.cli.printing.certificates import state_text

    number = f"certificate {answer.number}" if answer.number else "a file without a certificate's number"
    console.print(f"{file}: {number}, {REGISTER[answer.in_register]}", soft_wrap=True)
    if answer.certificate is not None:
        console.print(f"state: {state_text(answer.certificate)}", soft_wrap=True)
        for notice in answer.certificate.notices:
            console.print(f"notice: {notice}", soft_wrap=True)
    else:
        console.print(
            "state: not known, because this database has no such certificate; the page behind its QR code says it",
            soft_wrap=True,
        )
    if answer.signatures:
        console.print(_signer(answer), soft_wrap=True)
    for signature in answer.signatures:
        console.print(_signature(signature), soft_wrap=True)
    if not answer.signatures:
        console.print("no signature", soft_wrap=True)


def _signer(answer: VerifiedFileResponse) -> str:
    signer = f"signed by {answer.signed_by.subject}" if answer.signed_by else "not signed by a valid signature"
    if answer.expected_signers:
        return f"{signer}; expected: {' or '.join(answer.expected_signers)}"
    return f"{signer}; any signer is accepted, because --signer names none"


def _signature(signature: SignatureResponse) -> str:
    signer = (
        ""
        if signature.signed_by is None
        else f" by {signature.signed_by.subject} ({signature.signed_by.fingerprint[:16]})"
    )
    if not signature.valid:
        return f"{signature.form} signature{signer}: NOT VALID: {signature.problem}"
    at = "" if signature.signed_at is None else f", {signature.signed_at:%Y-%m-%d %H:%M} UTC as the signer states"
    trust = signature.reason if signature.trust == "not established" else f"{signature.trust}: {signature.reason}"
    other = "; NOT BY AN EXPECTED SIGNER" if signature.expected is False else ""
    return f"{signature.form} signature{signer}: valid{at}; {trust}{other}"
