"""`labctl diagnose`: experiments on the bench until one cause is left."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import BenchName, Database, Json, Serial, recording_numbers
from labctl.cli.output import print_json, stderr
from labctl.cli.printing.diagnosis import DiagnosisPrinter, print_diagnosis_end

if TYPE_CHECKING:
    from labctl.answers.diagnosis import DiagnosisRequest, DiagnosisResponse, DiagnosisRound
    from labctl.services.diagnosis.foreground import Reply

Hours = Annotated[
    float | None,
    typer.Option("--hours", metavar="H", help="Largest time on the bench, h; default: 24."),
]
VersionOption = Annotated[
    int | None,
    typer.Option("--version", metavar="N", help="Version that is judged; default: the unit's newest version."),
]
RecordingOption = Annotated[
    str | None,
    typer.Option(
        "--recording",
        metavar="ID[,ID...]",
        help="Recordings to begin with, such as 1,2; default: those that the version was fitted to, and those of "
        "earlier diagnoses.",
    ),
]
EndOption = Annotated[
    bool, typer.Option("--end", help="End the diagnosis of the unit that has not ended, for good; run nothing.")
]


def diagnose(
    serial: Serial,
    bench: BenchName = None,
    hours: Hours = None,
    version: VersionOption = None,
    recording: RecordingOption = None,
    end: EndOption = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Run experiments one after the other until one missing effect is left, or no experiment can distinguish more.

    A diagnosis that was stopped is continued. On a bench that is not simulated each experiment has to be confirmed.
    """
    from labctl.answers.diagnosis import DiagnosisRequest
    from labctl.services.diagnosis.foreground import end_here

    with one_clear_line():
        if end:
            answer = end_here(database, serial)
        else:
            given = {"version": version, "recordings": recording_numbers(recording)}
            request = DiagnosisRequest.model_validate(given if hours is None else {**given, "hours": hours})
            answer = _run(database, serial, request, bench, quiet=as_json)
    if as_json:
        print_json(answer)
    else:
        print_diagnosis_end(answer)
    if not answer.ended or answer.outcome == "insufficient_data":
        raise typer.Exit(1)


def _run(
    database: str | None, serial: str, request: DiagnosisRequest, bench: str | None, *, quiet: bool
) -> DiagnosisResponse:
    from labctl.cli.campaign_terminal import campaign_terminal
    from labctl.services.diagnosis.foreground import ForegroundDiagnosis, begin_here

    printer = DiagnosisPrinter(quiet=quiet)
    answer, is_new = begin_here(database, serial, request, bench)
    if not is_new:
        stderr.print(
            f"labctl: diagnosis {answer.id} of {serial} has not ended and goes on with its own bench, hours, version "
            "and recordings"
        )
    return ForegroundDiagnosis(database, campaign_terminal(quiet=quiet), ask_experiment, printer.update).run(answer.id)


def ask_experiment(answer: DiagnosisResponse, proposed: DiagnosisRound) -> Reply | None:
    """Put an experiment on a real bench to the person at the terminal; None without a terminal or an answer."""
    if not sys.stdin.isatty():
        return None
    from labctl.cli.terminal_operator import ask_bench_clear
    from labctl.config import os_user
    from labctl.services.benches.start_confirmation import QUESTIONS

    stderr.print(
        f"Experiment of round {proposed.number} on bench {answer.bench}: {proposed.why}. Type yes to run it, the "
        "reason why it cannot be done, or nothing to leave it for later."
    )
    line = sys.stdin.readline().strip()
    if not line:
        return None
    if line.lower() not in {"yes", "y"}:
        return "cannot_be_done", os_user(), line
    by = ask_bench_clear({str(check): text for check, text in QUESTIONS.items()})
    return ("confirmed", by, "") if by else None
