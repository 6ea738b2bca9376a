"""`labctl serve`, `labctl stop`, `labctl simulator` and `labctl demo`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.command_log import log_of_command
from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import BenchName, Database, Json, SimulatedStart, simulated_start
from labctl.cli.output import console, give_up_blocked_stderr, print_json, stderr

if TYPE_CHECKING:
    from labctl.processes.settings import ServeRequest
    from labctl.processes.supervisor import Ready

MaxUpload = Annotated[
    int, typer.Option("--max-upload-mib", metavar="N", help="Largest recording that may be sent, in MiB.")
]

WireLogs = Annotated[
    Path | None,
    typer.Option(
        "--wire-logs",
        metavar="DIR",
        help="Folder for a wire log of each campaign: campaign-7.jsonl.gz, campaign-7-resumed.jsonl.gz.",
    ),
]

RequireKeys = Annotated[
    bool,
    typer.Option(
        "--require-keys",
        help="Require an API key on loopback (127.0.0.1) too; on other addresses a key is always required.",
    ),
]


ReadOnlyService = Annotated[
    bool,
    typer.Option(
        "--read-only",
        help="Serve pages and answers only: drive no bench and change nothing in the database; it may be a replica.",
    ),
]

ActsAt = Annotated[
    str | None,
    typer.Option(
        "--acts-at", metavar="URL", help="Address of the service that acts; a read-only service names it in refusals."
    ),
]

Processes = Annotated[
    int, typer.Option("--processes", metavar="N", help="Processes of a read-only service that answer at the same port.")
]


def serve(
    bench: BenchName = None,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Run a simulated bench; default bench: triaxial-sim.")
    ] = False,
    speed: Annotated[
        float,
        typer.Option(
            "--speed", metavar="X", help="Speed of a simulated bench: X times real time; 0: as fast as possible."
        ),
    ] = 1.0,
    simulated_from: SimulatedStart = None,
    host: Annotated[str, typer.Option("--host", metavar="ADDRESS", help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", metavar="N", help="TCP port; 0 chooses a free port.")] = 8420,
    require_keys: RequireKeys = False,
    max_upload_mib: MaxUpload = 2048,
    wire_logs: WireLogs = None,
    read_only: ReadOnlyService = False,
    acts_at: ActsAt = None,
    processes: Processes = 1,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Serve calibrations over HTTP and run campaigns on the bench. Ctrl-C stops it and leaves the bench in its
    safe state."""
    from labctl.processes.settings import ServeRequest

    with one_clear_line():
        start_at = simulated_start(simulated_from)
    request = ServeRequest(
        bench=bench, simulate=simulate, speed=speed, simulated_start=start_at, host=host, port=port, database=database,
        require_keys=require_keys, max_upload_mib=max_upload_mib, wire_logs=wire_logs, read_only=read_only,
        acts_at=acts_at, processes=processes,
    )  # fmt: skip

    def ready(service: Ready) -> None:
        _print_ready(service, request, as_json=as_json)

    with one_clear_line(), log_of_command("supervisor", default="info", location=request.location):
        try:
            unconfirmed = _serve(request, ready)
        finally:
            give_up_blocked_stderr()
    stderr.print(f"labctl: stopped{'; ' if unconfirmed else ''}{unconfirmed}")


def _serve(request: ServeRequest, ready: Callable[[Ready], None]) -> str:
    """Serve until interrupted; returns how the bench was left."""
    if request.read_only:
        from labctl.processes.read_only_supervisor import serve_read_only

        return serve_read_only(request, ready)
    from labctl.processes.supervisor import serve_forever

    _migrated(request.location)
    return serve_forever(request, ready)


def _print_ready(service: Ready, request: ServeRequest, *, as_json: bool) -> None:
    """Print the address of a service and the state of its bench at the start."""
    from labctl.answers.service import ServiceReady
    from labctl.services.read_access import acting_service

    named, start_at = request.bench_name, request.simulated_start
    unconfirmed, cut_short = ("", "") if named is None else _found(named, request.database)
    if as_json:
        service_ready = ServiceReady(**asdict(service), unconfirmed=unconfirmed, cut_short=cut_short)
        print_json(service_ready, one_line=True)
        return
    console.print(f"labctl listens on {service.url}  (HTTP interface: {service.url}/api-docs)")
    if request.read_only:
        console.print(
            f"read-only: every request that changes something is refused; send it to {acting_service(request.acts_at)}",
            soft_wrap=True,
        )
    if start_at is not None:
        console.print(f"the date of this service is simulated: {start_at:%Y-%m-%d %H:%M} UTC")
    for text in filter(None, (unconfirmed, cut_short)):
        console.print(text, style="yellow", soft_wrap=True)


def _migrated(location: str) -> None:
    """Bring a database of an earlier version up to date before the service starts, and say so; a seal or signing key
    that cannot be used is refused."""
    from labctl.cli.printing.migration import migration_text
    from labctl.log import get_logger
    from labctl.services.admin.maintenance import migrate_before_service
    from labctl.services.admin.seal_keys import refuse_unusable_keys

    refuse_unusable_keys()
    answer = migrate_before_service(location)
    if answer is not None:
        stderr.print(f"labctl: {migration_text(answer)}")
        get_logger().warning("database.migrated", said=migration_text(answer))


def _found(source: str, database: str | None) -> tuple[str, str]:
    """Return what is wrong with a bench when its service starts, and which campaign was left there; empty for
    nothing."""
    from labctl.services.benches.confirmation import describe_bench
    from labctl.services.campaigns.recovery import describe_recovery
    from labctl.services.planning.loading import load_bench
    from labctl.services.read_access import open_readonly

    name = load_bench(source).name
    with open_readonly(database) as store:
        row = store.benches.get(name)
        unconfirmed = describe_bench(row) if row is not None and row.unconfirmed else ""
        return unconfirmed, describe_recovery(store, name)


def stop(
    bench: Annotated[
        str | None, typer.Option("--bench", metavar="FILE", help="Stop this bench only: bench file or name.")
    ] = None,
    by: Annotated[
        str | None, typer.Option("--by", metavar="NAME", help="Who stops; default: the user who is logged in.")
    ] = None,
    reason: Annotated[
        str, typer.Option("--reason", metavar="TEXT", help="Reason for the stop; it is recorded.")
    ] = "stopped from the command line",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Stop the bench now, whichever process of labctl still runs; exit status 0 only when the table stands.

    Without options: every bench that this user has driven on this computer. What was stopped moves again only when a
    person starts or resumes a campaign, or runs `labctl bench clear`.
    """
    from labctl.stop.program import StopArguments, run

    raise typer.Exit(run(StopArguments(bench, database, by, reason, as_json)))


def simulator(
    bench: Annotated[str, typer.Argument(metavar="BENCH", help="Bench file, or the name of a shipped bench.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="Path of a bench file to write; it names the addresses of the simulated instruments.",
        ),
    ] = None,
    speed: Annotated[
        float, typer.Option("--speed", metavar="X", help="Speed of the simulated instruments: X times real time.")
    ] = 1.0,
    log: Annotated[
        Path | None,
        typer.Option(
            "--log",
            metavar="FILE",
            help="Path of a file to write: all bytes that the instruments receive, as JSON lines.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Serve a bench's simulated instruments on pseudo-terminals and TCP ports, until Ctrl-C."""
    from labctl.answers.service import SimulatorReady
    from labctl.services.benches.check import serve_simulator

    def ready(addresses: dict[str, str]) -> None:
        if as_json:
            print_json(SimulatorReady(addresses=addresses, bench_file=str(out) if out else None), one_line=True)
            return
        for device, address in addresses.items():
            console.print(f"{device:14} {address}")
        if out:
            console.print(f"bench file: {out}")

    with one_clear_line():
        serve_simulator(bench, out, speed, ready, log)


def demo(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder into which the demo writes its files.")
    ] = Path("demo-output"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Run a smaller tri-axial campaign, so that the demo ends sooner.")
    ] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Demonstrate every step on simulated benches in virtual time and on a real gyro's recording; print each result."""
    from labctl.cli.demo import run_demo

    with one_clear_line():
        figures = run_demo(out, database, quick=quick, quiet=as_json)
    if as_json:
        print_json(figures)
