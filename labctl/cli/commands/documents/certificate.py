"""`labctl certificate`: issue the certificate of a version, or write the one that was issued; withdraw one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Serial
from labctl.cli.output import console, print_json, stderr

if TYPE_CHECKING:
    from labctl.answers.certificates import CertificateOrder, CertificateResponse

#: The command that is meant where none is named.
USUAL = "issue"


class _IssueUnlessNamed(TyperGroup):
    """Takes `labctl certificate SERIAL ...` for `labctl certificate issue SERIAL ...`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the usual command in front of arguments that begin with none, and do not ask for help alone."""
        if args and args[0] not in (*self.commands, "--help"):
            args = [USUAL, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_IssueUnlessNamed,
    no_args_is_help=True,
    help="Issue a certificate, or withdraw one. `labctl certificate SERIAL --out FILE` is short for "
    "`labctl certificate issue SERIAL --out FILE`.",
)

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


@app.command(USUAL)
def issue(
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
    from labctl.answers.certificates import CertificateRequest
    from labctl.services.certificates.served import certificate_file, format_of
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import ISSUE_CERTIFICATE
    from labctl.services.commands.requests import ToVersion
    from labctl.services.read_access import open_readonly

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
        _say_state(answer)
        return
    issued = f"issued {answer.issued_at:%Y-%m-%d} by {answer.by}"
    issued += f", replaces {answer.replaces}" if answer.replaces else ""
    issued += f", signed by {answer.signed_by.subject}" if answer.signed_by else ""
    console.print(f"certificate {answer.number} of {serial} version {number}, {issued} -> {out}")
    _say_state(answer)


@app.command("withdraw")
def withdraw(
    number: Annotated[str, typer.Argument(metavar="NUMBER", help="Number of the certificate.")],
    reason: Annotated[
        str, typer.Option("--reason", metavar="TEXT", help="Why; the list, the served file and the page say it.")
    ],
    by: Annotated[
        str | None,
        typer.Option(
            "--by", metavar="NAME", help="Name of the person who withdraws it; default: the user who is logged in."
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Withdraw a certificate. Its files stay as they were issued; the list, the page behind its QR code and the headers
    of HTTP say that it is withdrawn. `labctl revoke` withdraws every certificate of a version."""
    from labctl.acting_user import actor
    from labctl.answers.certificates import WithdrawRequest
    from labctl.cli.printing.certificates import state_text
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import WITHDRAW_CERTIFICATE

    with one_clear_line():
        request = WithdrawRequest(number=number, by=by or actor().name, reason=reason)
        answer = execute(database, WITHDRAW_CERTIFICATE, request)
    if as_json:
        print_json(answer)
        return
    text = f"certificate {answer.number} of {answer.serial} version {answer.version} is {state_text(answer)}"
    console.print(text, soft_wrap=True)


def _say_state(answer: CertificateResponse) -> None:
    """Print on standard error that a certificate is not valid any more; its file cannot say so."""
    from labctl.cli.printing.certificates import state_text

    if answer.state != "valid":
        text = f"labctl: certificate {answer.number} is {state_text(answer)}"
        stderr.print(text, style="bold red", soft_wrap=True)


def read_order(path: Path | None) -> CertificateOrder:
    """Return the facts of an order file; none without a file. Raises BadInput naming the file, the key and why."""
    import tomllib

    from pydantic import ValidationError

    from instruments.toml_documents import listed, read_toml, shown
    from labctl.answers.certificates import CertificateOrder
    from labctl.errors import BadInput

    if path is None:
        return CertificateOrder()
    try:
        return CertificateOrder.model_validate(read_toml(path))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: not TOML ({error}); correct it") from error
    except ValidationError as error:
        text = listed(
            f"{'.'.join(map(str, each['loc']))} = {shown(each['input'])}: {each['msg']}" for each in error.errors()
        )
        raise BadInput(f"{path}: {text}; correct it (docs/how-to/certificates.md lists the keys)") from error
