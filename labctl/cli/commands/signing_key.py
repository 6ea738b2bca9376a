"""`labctl signing-key`: the key that signs certificates, outside the database."""

from __future__ import annotations

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json

app = typer.Typer(
    no_args_is_help=True,
    help="The key that signs certificates; $LABCTL_SIGN_KEY names it: a PEM or PKCS#12 file, or a PKCS#11 URI.",
)


@app.callback()
def signing_key() -> None:
    """The key that signs certificates; $LABCTL_SIGN_KEY names it: a PEM or PKCS#12 file, or a PKCS#11 URI."""


@app.command("show")
def show(
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Print whose the signing key is, and until when it may sign."""
    from labctl.services.certificates.signature import show_signing_key

    with one_clear_line():
        answer = show_signing_key()
    if as_json:
        print_json(answer)
        return
    for name, value in (
        ("subject", answer.subject),
        ("issuer", answer.issuer),
        ("fingerprint", answer.fingerprint),
        ("valid", f"{answer.valid_from:%Y-%m-%d} to {answer.valid_until:%Y-%m-%d}"),
    ):
        console.print(f"{name}: {value}", soft_wrap=True)
