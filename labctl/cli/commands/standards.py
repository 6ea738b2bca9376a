"""`labctl standards`: reference standards, check gyros, and comparisons of laboratories."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import By, Database, Json, Serial, day, instant, who
from labctl.cli.output import print_json
from labctl.cli.printing.standards import print_affected, print_check_gyro, print_comparison, print_list, print_standard

if TYPE_CHECKING:
    from labctl.answers.standards import CertifiedPointRequest

app = typer.Typer(
    no_args_is_help=True, help="Reference standards: certificates over time, drift, checks, and where each was used."
)

Label = Annotated[str, typer.Argument(metavar="LABEL", help="Label of the standard, or its serial number.")]
On = Annotated[
    str | None, typer.Option("--on", metavar="DATE", help="Day for the state and the prediction; default: today.")
]
Temperature = Annotated[
    float | None, typer.Option("--temperature-c", metavar="T", help="Temperature of the results, deg C.")
]


@app.command("list")
def list_(on: On = None, as_json: Json = False, database: Database = None) -> None:
    """List the standards: state, due date, newest certificate, drift."""
    from instruments.clock import SystemClock
    from labctl.services.read_access import open_readonly
    from labctl.services.standards.register import list_standards

    with one_clear_line(), open_readonly(database) as store:
        answers = list_standards(store, day(on, "--on") or SystemClock().utc().date())
    if as_json:
        print_json(answers)
    else:
        print_list(answers)


@app.command("add")
def add(
    label: Annotated[str, typer.Argument(metavar="LABEL", help="Name of the standard, as bench files name it.")],
    quantity: Annotated[
        str,
        typer.Option("--quantity", metavar="QUANTITY", help="Such as thermometer, clock or fixture_angle, or another."),
    ],
    unit: Annotated[
        str | None, typer.Option("--unit", metavar="UNIT", help="Unit of its values; default: that of a bench file.")
    ] = None,
    serial: Annotated[str, typer.Option("--serial", metavar="NUMBER", help="Serial number of the standard.")] = "",
    description: Annotated[str, typer.Option("--description", metavar="TEXT", help="What it is.")] = "",
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Enter a standard in the register."""
    from labctl.answers.standards import StandardRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.standards import ADD_STANDARD

    with one_clear_line():
        request = StandardRequest(
            label=label, quantity=quantity, unit=unit, serial=serial, description=description, by=who(by)
        )
        answer = execute(database, ADD_STANDARD, request)
    print_json(answer) if as_json else print_standard(answer)


@app.command("show")
def show(label: Label, on: On = None, as_json: Json = False, database: Database = None) -> None:
    """Show a standard: certificates, predicted value, control chart of its checks, findings."""
    from instruments.clock import SystemClock
    from labctl.services.read_access import open_readonly
    from labctl.services.standards.register import one_standard

    with one_clear_line(), open_readonly(database) as store:
        answer = one_standard(store, label, day(on, "--on") or SystemClock().utc().date())
    print_json(answer) if as_json else print_standard(answer)


@app.command("certificate")
def certificate(
    label: Label,
    number: Annotated[str, typer.Option("--number", metavar="NUMBER", help="Number of the certificate.")],
    laboratory: Annotated[str, typer.Option("--laboratory", metavar="NAME", help="Laboratory that issued it.")],
    calibrated: Annotated[str, typer.Option("--calibrated", metavar="DATE", help="Day of the calibration.")],
    point: Annotated[
        list[str],
        typer.Option(
            "--point",
            metavar="[NOMINAL:]ERROR:U",
            help="Error (indicated minus true; empty: not stated) and expanded uncertainty, in the unit of the "
            "standard, at a nominal where it has one; may be repeated.",
        ),
    ],
    k: Annotated[float, typer.Option("--k", metavar="K", help="Coverage factor of the expanded uncertainties.")] = 2.0,
    due: Annotated[
        str | None, typer.Option("--due", metavar="DATE", help="Last day on which the standard may be used.")
    ] = None,
    adjusted: Annotated[
        bool, typer.Option("--adjusted", help="The standard was adjusted before: no drift leads across it.")
    ] = False,
    traceability: Annotated[
        str, typer.Option("--traceability", metavar="TEXT", help="Statement of traceability.")
    ] = "",
    reason: Annotated[
        str, typer.Option("--reason", metavar="TEXT", help="Why it replaces an entry of the same number.")
    ] = "",
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Enter a certificate of a standard."""
    from labctl.answers.standards import StandardCertificateRequest
    from labctl.errors import BadInput
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToStandard
    from labctl.services.commands.standards import ADD_STANDARD_CERTIFICATE

    with one_clear_line():
        if (calibrated_on := day(calibrated, "--calibrated")) is None:
            raise BadInput("--calibrated is empty; give the day of the calibration, such as 2026-03-01")
        request = StandardCertificateRequest(
            number=number, laboratory=laboratory, calibrated=calibrated_on, due=day(due, "--due"), adjusted=adjusted,
            traceability=traceability, points=[_point(each, k) for each in point], reason=reason, by=who(by),
        )  # fmt: skip
        answer = execute(database, ADD_STANDARD_CERTIFICATE, ToStandard(label, request))
    print_json(answer) if as_json else print_standard(answer)


def _point(text: str, k: float) -> CertifiedPointRequest:
    """Return the point of "[NOMINAL:]ERROR:U". Raises BadInput."""
    from labctl.answers.standards import CertifiedPointRequest
    from labctl.errors import BadInput

    parts = text.split(":")
    try:
        *nominal, error, expanded = [float(part) if part.strip() else None for part in parts]
    except ValueError:
        nominal, error, expanded = [], None, None
    if expanded is None or len(nominal) > 1:
        raise BadInput(f"--point {text!r}: write [NOMINAL:]ERROR:U, such as -40:0.012:0.03, or :0.03 without an error")
    return CertifiedPointRequest(nominal=nominal[0] if nominal else None, value=error, expanded=expanded, k=k)


@app.command("check")
def check(
    label: Label,
    value: Annotated[float, typer.Option("--value", metavar="X", help="Error that was found: indicated minus true.")],
    u: Annotated[float, typer.Option("--u", metavar="U", help="Standard uncertainty of the check.")],
    nominal: Annotated[
        float | None, typer.Option("--nominal", metavar="X", help="Nominal value that was checked.")
    ] = None,
    at: Annotated[str | None, typer.Option("--at", metavar="TIME", help="Time of the check; default: now.")] = None,
    note: Annotated[str, typer.Option("--note", metavar="TEXT", help="How it was checked.")] = "",
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Enter an intermediate check; exit status 1 when it is out of the control limits."""
    from labctl.answers.standards import StandardCheckRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToStandard
    from labctl.services.commands.standards import ADD_STANDARD_CHECK

    with one_clear_line():
        request = StandardCheckRequest(
            value=value, u=u, nominal=nominal, checked_at=instant(at, "--at"), note=note, by=who(by)
        )
        answer = execute(database, ADD_STANDARD_CHECK, ToStandard(label, request))
    print_json(answer) if as_json else print_standard(answer)
    if answer.state in {"check it", "bad"}:
        raise typer.Exit(1)


@app.command("bad")
def bad(
    label: Label,
    bad_from: Annotated[
        str, typer.Option("--from", metavar="DATE", help="First day on which it may have been bad: the last good one.")
    ],
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="What was found.")],
    bad_until: Annotated[
        str | None, typer.Option("--until", metavar="DATE", help="Last such day; default: it is still bad.")
    ] = None,
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Say that a standard was found bad, and list the calibrations that it was used for on these days."""
    from labctl.answers.standards import StandardBadRequest
    from labctl.errors import BadInput
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToStandard
    from labctl.services.commands.standards import MARK_STANDARD_BAD
    from labctl.services.read_access import open_readonly
    from labctl.services.standards.usage import affected as affected_by

    with one_clear_line():
        if (first := day(bad_from, "--from")) is None:
            raise BadInput("--from is empty; give the first day, such as 2026-03-01")
        last = day(bad_until, "--until")
        request = StandardBadRequest(bad_from=first, bad_until=last, reason=reason, by=who(by))
        execute(database, MARK_STANDARD_BAD, ToStandard(label, request))
        with open_readonly(database) as store:
            answer = affected_by(store, label, first, last)
    print_json(answer) if as_json else print_affected(answer)


@app.command("withdraw")
def withdraw(
    label: Label,
    finding: Annotated[int, typer.Option("--finding", metavar="N", help="Number of the finding.")],
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why the finding was wrong.")],
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Withdraw a finding that was wrong."""
    from labctl.answers.standards import WithdrawFindingRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToFinding
    from labctl.services.commands.standards import WITHDRAW_FINDING

    with one_clear_line():
        request = WithdrawFindingRequest(reason=reason, by=who(by))
        answer = execute(database, WITHDRAW_FINDING, ToFinding(label, finding, request))
    print_json(answer) if as_json else print_standard(answer)


@app.command("affected")
def affected(
    label: Label,
    bad_from: Annotated[str | None, typer.Option("--from", metavar="DATE", help="First day.")] = None,
    bad_until: Annotated[str | None, typer.Option("--until", metavar="DATE", help="Last day.")] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """List the calibrations that a standard was used for; without days: those of its findings, else all."""
    from labctl.services.read_access import open_readonly
    from labctl.services.standards.usage import affected as affected_by

    with one_clear_line(), open_readonly(database) as store:
        answer = affected_by(store, label, day(bad_from, "--from"), day(bad_until, "--until"))
    print_json(answer) if as_json else print_affected(answer)


@app.command("check-gyro")
def check_gyro(
    serial: Serial,
    mark: Annotated[
        bool | None,
        typer.Option("--mark/--unmark", help="Make the unit a check gyro, or end that; default: show its charts."),
    ] = None,
    temperature_c: Temperature = None,
    chart_from: Annotated[
        str | None, typer.Option("--from", metavar="DATE", help="With --mark: first day of the charts.")
    ] = None,
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="With --mark or --unmark: why.")] = "",
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show the control charts of a check gyro; exit status 1 when its newest result is out of limits."""
    from labctl.answers.validity import CheckGyroRequest
    from labctl.services.check_gyros import check_gyro as charts_of
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToUnit
    from labctl.services.commands.standards import SET_CHECK_GYRO
    from labctl.services.read_access import open_readonly

    with one_clear_line():
        if mark is None:
            with open_readonly(database) as store:
                answer = charts_of(store, serial, temperature_c)
        else:
            request = CheckGyroRequest(
                marked=mark, temperature_c=temperature_c, chart_from=day(chart_from, "--from"), reason=reason,
                by=who(by),
            )  # fmt: skip
            answer = execute(database, SET_CHECK_GYRO, ToUnit(serial, request))
    print_json(answer) if as_json else print_check_gyro(answer)
    if answer.alarm:
        raise typer.Exit(1)


@app.command("compare")
def compare(
    first: Annotated[str, typer.Argument(metavar="SERIAL:VERSION", help="A calibration.")],
    second: Annotated[str, typer.Argument(metavar="SERIAL:VERSION", help="Another calibration of the same unit.")],
    temperature_c: Temperature = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Compare two laboratories or benches: En number and zeta score; exit status 1 where one |En| is above 1."""
    from labctl.services.interlaboratory import compare as compared
    from labctl.services.interlaboratory import pair_of
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = compared(store, pair_of(first), pair_of(second), temperature_c)
    print_json(answer) if as_json else print_comparison(answer)
    if not answer.satisfactory:
        raise typer.Exit(1)
