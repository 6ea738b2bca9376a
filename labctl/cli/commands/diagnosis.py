"""`labctl diagnose`: experiments on the bench until one cause is left."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import BenchName, Database, Json, Serial, recording_numbers
from labctl.cli.output import print_json, stderr
from labctl.cli.printing.diagnosis import DiagnosisPrinter, print_diagnosis_end
from labctl.errors import BadInput, Conflict, NotFound

if TYPE_CHECKING:
    from datetime import datetime

    from labctl.answers.diagnosis import (
        DiagnosisRequest,
        DiagnosisResponse,
        DiagnosisRound,
    )
    from labctl.services.diagnosis.begin import Reply

#: How often the service is asked how far a diagnosis is, s.
POLL_S = 1.0
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
AtOption = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="TIME",
        help="Begin no experiment before this time, in a running service: 2026-03-28T22:00. The recordings so far are "
        "judged at once.",
    ),
]
ZoneOption = Annotated[
    str | None,
    typer.Option("--time-zone", metavar="NAME", help="Time zone of --at; default: the time zone of this computer."),
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
    at: AtOption = None,
    time_zone: ZoneOption = None,
    end: EndOption = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Run experiments one after the other until one missing effect is left, or no experiment can distinguish more.

    A diagnosis that was stopped is continued. On a bench that is not simulated each experiment has to be confirmed.
    With --at the first experiment is chosen now, and the service begins it at that time.
    """
    from instruments.clock import SystemClock
    from labctl.answers.diagnosis import DiagnosisRequest
    from labctl.config import default_database
    from labctl.services.commands.open import diagnosis_service_url
    from labctl.store.connection.location import is_url

    with one_clear_line():
        if time_zone is not None and at is None:
            raise BadInput(f"--time-zone {time_zone}: it is that of --at, which is not given; give both or neither")
        options = {"version": version, "recordings": recording_numbers(recording), "at": at, "time_zone": time_zone}
        request = DiagnosisRequest.model_validate(options if hours is None else {**options, "hours": hours})
        printer = DiagnosisPrinter(quiet=as_json)
        url = diagnosis_service_url(database, serial, bench)
        if end:
            answer = _end(database, url, serial)
        elif url is not None:
            is_shared = is_url(database or default_database())  # there the service was found by its bench
            answer = _follow(url, serial, request, None if is_shared else bench, printer)
        elif at is not None:
            raise BadInput(
                f"--at {at}: no service uses this database, and without one nothing begins a diagnosis later; start "
                "`labctl serve`, or leave the option out"
            )
        else:
            answer = _run(database, serial, request, bench, printer)
    if as_json:
        print_json(answer)
    else:
        print_diagnosis_end(answer)
    is_set = at is not None and answer.begins_at is not None and answer.state == "measuring"
    is_well = answer.ended or is_set or waits_for_its_time(answer, SystemClock().utc())
    if not is_well or answer.outcome == "insufficient_data":
        raise typer.Exit(1)


def _end(database: str | None, url: str | None, serial: str) -> DiagnosisResponse:
    """End the open diagnosis of a unit, here or in the service that holds the database."""
    if url is None:
        from labctl.services.diagnosis.foreground import end_here

        return end_here(database, serial)
    from labctl.client import Client
    from labctl.config import os_user

    with Client(url) as client:
        number = next((each.id for each in client.diagnoses(serial) if not each.ended), None)
        if number is None:
            raise NotFound(f"unit {serial!r} has no open diagnosis; `labctl diagnose {serial}` starts one")
        return client.act_on_diagnosis(number, "end", "ended on the command line", by=os_user())


def _follow(
    url: str, serial: str, request: DiagnosisRequest, bench: str | None, printer: DiagnosisPrinter
) -> DiagnosisResponse:
    """Have the service that holds the database diagnose a unit, and print how it goes, until it ends or waits."""
    from instruments.clock import SystemClock
    from labctl.client import Client
    from labctl.config import os_user
    from labctl.services.diagnosis.begin import confirmation_of

    if bench is not None:
        raise Conflict(
            f"--bench {bench}: the service at {url} holds this database and diagnoses on its own bench; leave the "
            "option out, stop the service, or name another --database"
        )
    clock = SystemClock()
    with Client(url) as client:
        answer = next((each for each in client.diagnoses(serial) if not each.ended), None)
        if answer is not None and request.at is not None:
            raise Conflict(
                f"--at {request.at}: diagnosis {answer.id} of {serial} has not ended, and goes on as it was begun; "
                f"leave the option out, or end it with `labctl diagnose {serial} --end`"
            )
        if answer is None:
            answer = client.start_diagnosis(serial, request)
        elif answer.state in {"stopped", "failed"}:
            refuse_other_bench(answer, url, _bench_of(url))
            answer = client.act_on_diagnosis(answer.id, "resume", "continued on the command line", by=os_user())
        else:
            refuse_other_bench(answer, url, _bench_of(url))
        while not answer.ended and answer.state not in {"stopped", "failed"}:
            printer.update(answer)
            is_set = request.at is not None and answer.state == "measuring"
            if is_set or waits_for_its_time(answer, clock.utc()):
                return answer  # the service begins at that time
            if answer.state == "awaiting_confirmation":
                if (reply := ask_experiment(answer, answer.rounds[-1])) is None:
                    return answer
                answer = client.confirm_experiment(answer.id, confirmation_of(answer.rounds[-1].number, reply))
            else:
                clock.sleep(POLL_S)
                answer = client.diagnosis(answer.id)
    printer.update(answer)
    return answer


def waits_for_its_time(answer: DiagnosisResponse, now: datetime) -> bool:
    """Return whether the first experiment of a diagnosis is chosen, and the time of its begin is still to come."""
    waits = answer.state == "measuring" and answer.rounds[-1].campaign is None
    return waits and answer.begins_at is not None and now < answer.begins_at


def _bench_of(url: str) -> str:
    """Return the name of the bench that a service drives; empty for none."""
    from labctl.answers.service import HealthResponse
    from labctl.service_connection import ServiceConnection
    from labctl.services.commands.remote import HttpExecutor

    with ServiceConnection(url) as connection:
        bench = HttpExecutor(connection).fetch("/health", HealthResponse).bench
    return "" if bench is None else bench.name


def refuse_other_bench(answer: DiagnosisResponse, url: str, bench: str) -> None:
    """Raise Conflict for a diagnosis that the service of another bench would never go on with."""
    if bench != answer.bench:
        raise Conflict(
            f"diagnosis {answer.id} of {answer.serial} is on bench {answer.bench}, but the service at {url} drives "
            f"{bench or 'no bench'}; start the service of that bench, or end the diagnosis with `labctl diagnose "
            f"{answer.serial} --end`"
        )


def _run(
    database: str | None, serial: str, request: DiagnosisRequest, bench: str | None, printer: DiagnosisPrinter
) -> DiagnosisResponse:
    """Diagnose a unit in this process."""
    from labctl.cli.campaign_terminal import campaign_terminal
    from labctl.services.diagnosis.foreground import ForegroundDiagnosis, begin_here

    answer, is_new = begin_here(database, serial, request, bench)
    if not is_new:
        stderr.print(
            f"labctl: diagnosis {answer.id} of {serial} has not ended and goes on with its own bench, hours, version "
            "and recordings"
        )
    terminal = campaign_terminal(quiet=printer.quiet)
    return ForegroundDiagnosis(database, terminal, ask_experiment, printer.update).run(answer.id)


def ask_experiment(answer: DiagnosisResponse, proposed: DiagnosisRound) -> Reply | None:
    """Put an experiment on a real bench to the person at the terminal; None without a terminal or an answer."""
    if not sys.stdin.isatty():
        return None
    from labctl.cli.terminal_operator import ask_bench_clear
    from labctl.config import os_user
    from labctl.services.benches.start_confirmation import QUESTIONS

    stderr.print(
        f"Experiment of round {proposed.number} on bench {answer.bench}: {proposed.why} Type yes to run it, the "
        "reason why it cannot be done, or nothing to leave it for later."
    )
    line = sys.stdin.readline().strip()
    if not line:
        return None
    if line.lower() not in {"yes", "y"}:
        return "cannot_be_done", os_user(), line
    by = ask_bench_clear({str(check): text for check, text in QUESTIONS.items()})
    return ("confirmed", by, "") if by else None
