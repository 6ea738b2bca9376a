"""`labctl seal-key`: the key that signs manifests, outside the database."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json

app = typer.Typer(
    no_args_is_help=True,
    help="The key that signs the manifests of records; $LABCTL_SEAL_KEY names it: a PEM file or a PKCS#11 URI.",
)


@app.command("create")
def create(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Path of the private key to write; the public key is FILE.pub.")
    ],
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Make an Ed25519 key in a file that only its owner can read."""
    from labctl.services.admin.seal_keys import create_seal_key

    with one_clear_line():
        answer = create_seal_key(file)
    if as_json:
        print_json(answer)
        return
    console.print(f"private key: {answer.file}; name it by LABCTL_SEAL_KEY", soft_wrap=True)
    console.print(f"public key: {answer.public_file}; check with --key", soft_wrap=True)
    console.print(f"fingerprint: {answer.fingerprint}", soft_wrap=True)


@app.command("show")
def show(
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Print the public key of the key in use, in PEM form."""
    from labctl.services.admin.seal_keys import show_seal_key

    with one_clear_line():
        answer = show_seal_key()
    print_json(answer) if as_json else console.print(answer.public_key.strip(), soft_wrap=True)


@app.command("sign")
def sign(as_json: Json = False, database: Database = None) -> None:
    """Sign the newest manifest now, and with it all before; a service signs by itself."""
    from labctl.services.admin import seal_keys

    with one_clear_line():
        answer = seal_keys.sign(database)
    if as_json:
        print_json(answer)
        return
    state_text = "is signed already" if answer.signed is None else f"was signed: manifests 1 to {answer.signed}"
    console.print(f"the chain {state_text}; key {answer.fingerprint[:16]}", soft_wrap=True)
