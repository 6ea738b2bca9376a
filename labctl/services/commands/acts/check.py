"""Ask every instrument of a bench what it is and how it does; nothing moves."""

from __future__ import annotations

from labctl.answers.benches import BenchCheckResponse, CheckRequest
from labctl.errors import NotFound
from labctl.services.benches.driving_process import whereabouts
from labctl.services.commands.command import Command
from labctl.services.commands.context import OPENS_BENCH_S, BenchAct, CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToBench

AddressedRequest = ToBench[CheckRequest]


def _in_service(control: ServiceBench, context: CommandContext, request: AddressedRequest) -> BenchCheckResponse:
    """Check this service's bench. Raises NotFound for another one, BenchBusy while a campaign runs."""
    runner = control.bench_runner()
    if request.bench != runner.bench.name:
        shared = context.store.is_shared
        advice = whereabouts(context.store, request.bench) if shared else f"name bench {runner.bench.name}"
        raise NotFound(
            f"this service drives bench {runner.bench.name}, not {request.bench!r}, and can check only its own bench; "
            f"{advice}"
        )
    checked = runner.check()
    context.store.audit.record(context.now(), "bench check", f"bench {checked.bench}", {"ok": checked.ok})
    return checked


def _in_foreground(control: Foreground, _: CommandContext, request: AddressedRequest) -> BenchCheckResponse:
    """Check a bench by its file or its shipped name, in this process."""
    return control.check(request.bench)


CHECK = BenchAct(name="check", in_service=_in_service, in_foreground=_in_foreground, wait_s=OPENS_BENCH_S)
CHECK_BENCH = Command(
    method="POST", path="/api/benches/{bench}/check", handler=CHECK.execute, responses={200: BenchCheckResponse}
)
