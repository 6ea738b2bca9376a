"""`labctl fleet`: many units at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.option_groups import with_options
from labctl.cli.options import AcceptWarnings, Database, Json, Limit, names_in
from labctl.cli.output import print_json

if TYPE_CHECKING:
    from labctl.answers.fleet import FleetJobRequest, FleetJobResponse
    from labctl.cli.printing.fleet import FleetProgress

#: How often a service is asked how far a job is, s.
POLL_S = 0.5

app = typer.Typer(
    no_args_is_help=True,
    help="Many units at once: fit or criticise all of a type, with the results written once, and report on them.",
)

FitModel = Annotated[
    str,
    typer.Option(
        "--model",
        metavar="NAME",
        help="Name of the error model to fit, as of `labctl fit`; `labctl effects` lists the models.",
    ),
]
NewestModel = Annotated[
    str,
    typer.Option(
        "--model",
        metavar="NAME",
        help="Only units whose newest version is of this error model, as of `labctl fit`; default: of any.",
    ),
]
UnitType = Annotated[
    str,
    typer.Option(
        "--type",
        metavar="NAME",
        help="Only units of this type: their model, as their manufacturer names it; default: of any.",
    ),
]
Batch = Annotated[str, typer.Option("--batch", metavar="BATCH", help="Only units of this batch.")]
Supplier = Annotated[str, typer.Option("--supplier", metavar="NAME", help="Only units of this supplier.")]
Search = Annotated[
    str, typer.Option("--search", metavar="TEXT", help="Only units that hold this text, in any case; default: all.")
]
EngineName = Annotated[
    str,
    typer.Option(
        "--engine",
        metavar="ENGINE",
        help="What computes: local (processes of this computer), dask (a cluster of Dask on this computer) or "
        "dask://HOST:PORT (the scheduler of a cluster).",
    ),
]
SourceUrl = Annotated[
    str,
    typer.Option(
        "--source",
        metavar="URL",
        help="Storage that the readings are read from instead of the database, as s3://bucket/lab; `labctl fleet "
        "publish` writes them there.",
    ),
]
Again = Annotated[
    bool,
    typer.Option(
        "--again", help="Compute also units whose newest result has the same recordings, model and program already."
    ),
]
JobId = Annotated[int, typer.Argument(metavar="JOB", help="Number of the job.")]


@dataclass(frozen=True)
class JobOptions:
    """The options of every job: which units, what computes, and where the readings are."""

    type_: UnitType = ""
    batch: Batch = ""
    supplier: Supplier = ""
    search: Search = ""
    engine: EngineName = "local"
    source: SourceUrl = ""
    again: Again = False
    as_json: Json = False
    database: Database = None

    def carry_out(self, kind: Literal["fit", "criticise"], **changes: Any) -> None:
        """Begin a job and follow it to its end. Exits with status 1 where a unit failed, 2 for bad input."""
        from labctl.answers.fleet import FleetJobRequest

        with one_clear_line():
            request = FleetJobRequest(
                kind=kind, type=self.type_, batch=self.batch, supplier=self.supplier, search=self.search,
                engine=self.engine, source=self.source, again=self.again, **changes,
            )  # fmt: skip
            _carry_out(self.database, request, as_json=self.as_json)


@app.command()
@with_options(JobOptions)
def fit(
    options: JobOptions,
    model: FitModel = "",
    effects: Annotated[
        str | None,
        typer.Option(
            "--effects",
            metavar="A,B,C",
            help="Ids of the effects of the model, or with --model of effects to add to it; `name:2` sets the "
            "polynomial order to 2.",
        ),
    ] = None,
    accept_warnings: AcceptWarnings = False,
) -> None:
    """Fit a model to the newest recording of each unit; it becomes the unit's next version and is not put in force.

    Ctrl-C ends the job; what was written stays, and the same command goes on there. Exit status 1 where a unit could
    not be fitted.
    """
    options.carry_out("fit", model=model, effects=names_in(effects), accept_warnings=accept_warnings)


@app.command()
@with_options(JobOptions)
def criticise(options: JobOptions, model: NewestModel = "") -> None:
    """Compare the newest version of each unit with its newest recording; exit status 1 where a unit could not be."""
    options.carry_out("criticise", model=model)


@app.command()
def publish(
    url: Annotated[
        str,
        typer.Argument(metavar="URL", help="Storage, as s3://bucket/lab or file:///data/lab, without credentials."),
    ],
    type_: UnitType = "",
    batch: Batch = "",
    supplier: Supplier = "",
    search: Search = "",
    again: Annotated[bool, typer.Option("--again", help="Write also recordings that are there unchanged.")] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Write the recordings that a job reads to a storage, one folder each; exit status 1 where one could not be.

    A recording that is there unchanged is not written again.
    """
    from labctl.answers.fleet import FleetPublishRequest
    from labctl.answers.storage_url import EXAMPLES, refused_because
    from labctl.cli.stage_line import stage_line
    from labctl.errors import BadInput
    from labctl.services.fleet.publishing import publish as publish_recordings
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store, stage_line():
        if reason := refused_because(url):
            raise BadInput(f"URL is refused: {reason}; give scheme, place and folder only, as {EXAMPLES}")
        request = FleetPublishRequest(
            url=url, type=type_, batch=batch, supplier=supplier, search=search, again=again
        )  # fmt: skip
        answer = publish_recordings(store, request)
    if as_json:
        print_json(answer)
    else:
        from labctl.cli.printing.fleet import print_published

        print_published(answer)
    if answer.failed:
        raise typer.Exit(1)


@app.command()
def report(
    model: NewestModel = "",
    type_: UnitType = "",
    batch: Batch = "",
    supplier: Supplier = "",
    search: Search = "",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Report on the units of a type: error over noise floor, verdicts, due dates, which batch, bench or unit differs,
    and which effect the model of the type is missing."""
    from instruments.clock import SystemClock
    from labctl.answers.fleet import FleetReportRequest
    from labctl.cli.stage_line import stage_line
    from labctl.services.fleet.report import fleet_report
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store, stage_line():
        request = FleetReportRequest(type=type_, model=model, batch=batch, supplier=supplier, search=search)
        answer = fleet_report(store, request, SystemClock().utc())
    if as_json:
        print_json(answer)
    else:
        from labctl.cli.printing.fleet import print_report

        print_report(answer)


@app.command()
def jobs(limit: Limit = None, as_json: Json = False, database: Database = None) -> None:
    """List the jobs, newest first."""
    from instruments.clock import SystemClock
    from labctl.services.fleet.jobs import job_answers
    from labctl.services.read_access import open_readonly
    from labctl.store.paging import PageRequest

    with one_clear_line(), open_readonly(database) as store:
        answers = job_answers(store, PageRequest(limit=limit), SystemClock().utc()).rows
    if as_json:
        print_json(answers)
    else:
        from labctl.cli.printing.fleet import print_jobs

        print_jobs(answers)


@app.command()
def units(
    job: JobId,
    state: Annotated[
        str, typer.Option("--state", metavar="STATE", help="Only units in this state: waiting, done, failed, skipped.")
    ] = "",
    limit: Limit = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """List what came of each unit of a job; of one that could not be computed, the reason."""
    from typing import get_args

    from labctl.answers.fleet import FleetUnitState
    from labctl.errors import BadInput
    from labctl.services.fleet.jobs import unit_answers
    from labctl.services.read_access import open_readonly
    from labctl.store.paging import PageRequest

    with one_clear_line(), open_readonly(database) as store:
        states: dict[str, FleetUnitState] = {each: each for each in get_args(FleetUnitState)}
        if state and state not in states:
            raise BadInput(f"--state {state!r}: choose one of {', '.join(states)}")
        page = unit_answers(store, job, PageRequest(limit=limit), states.get(state))
    if as_json:
        print_json(page.rows)
    else:
        from labctl.cli.printing.fleet import print_units

        print_units(page.rows, page.total, "a larger --limit lists more")


@app.command()
def cancel(
    job: JobId,
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="Reason; it is recorded.")] = "",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Cancel a job that a service carries out; what was written stays, and the same request goes on there."""
    from labctl.answers.fleet import FleetCancelRequest
    from labctl.services.commands.fleet import CANCEL_FLEET_JOB, ToFleetJob
    from labctl.services.commands.open import execute

    with one_clear_line():
        answer = execute(database, CANCEL_FLEET_JOB, ToFleetJob(job, FleetCancelRequest(reason=reason)))
    _print(answer, as_json=as_json)


def _carry_out(database: str | None, request: FleetJobRequest, *, as_json: bool) -> None:
    from labctl.cli.printing.fleet import FleetProgress
    from labctl.services.commands.open import service_url

    with FleetProgress(quiet=as_json) as progress:
        if url := service_url(database):
            answer = _follow(url, request, progress)
        else:
            from labctl.services.fleet.foreground import run_here

            answer = run_here(database, request, progress.update)
    _print(answer, as_json=as_json, database=database)
    if answer.failed or answer.state != "done":
        raise typer.Exit(1)


def _follow(url: str, request: FleetJobRequest, progress: FleetProgress) -> FleetJobResponse:
    """Have the service that holds the database carry out a job; an interrupt cancels it there."""
    from instruments.clock import SystemClock
    from labctl.answers.fleet import FleetCancelRequest, FleetJobResponse
    from labctl.service_connection import ServiceConnection
    from labctl.services.commands.fleet import CANCEL_FLEET_JOB, START_FLEET_JOB, ToFleetJob
    from labctl.services.commands.remote import HttpExecutor

    clock = SystemClock()
    with ServiceConnection(url) as connection:
        service = HttpExecutor(connection)
        answer = service.execute(START_FLEET_JOB, request)
        try:
            while not answer.ended:
                progress.update(answer)
                clock.sleep(POLL_S)
                answer = service.fetch(f"/api/fleet/jobs/{answer.id}", FleetJobResponse)
        except KeyboardInterrupt:
            cancelled = FleetCancelRequest(reason="interrupted on the command line")
            service.execute(CANCEL_FLEET_JOB, ToFleetJob(answer.id, cancelled))
            raise
    return answer


def _print(answer: FleetJobResponse, *, as_json: bool, database: str | None = None) -> None:
    if as_json:
        print_json(answer)
        return
    from labctl.cli.printing.fleet import print_job, print_units

    print_job(answer)
    if answer.failed:
        from labctl.services.fleet.jobs import unit_answers
        from labctl.services.read_access import open_readonly
        from labctl.store.paging import PageRequest

        with open_readonly(database) as store:
            page = unit_answers(store, answer.id, PageRequest(limit=20), "failed")
        print_units(page.rows, page.total, f"`labctl fleet units {answer.id} --state failed` lists all")
