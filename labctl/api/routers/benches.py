"""Benches: this service's, the state of every bench, and clearing one."""

from __future__ import annotations

from fastapi import APIRouter

from labctl.answers.benches import (
    BenchCheckResponse,
    BenchResponse,
    BenchStatus,
    CheckRequest,
    ClearRequest,
    StopResponse,
)
from labctl.answers.campaigns import ReasonRequest
from labctl.api.dependencies import ControlPoolDep, ServiceDep, command_route
from labctl.services.campaigns.bench_status import bench_statuses
from labctl.services.commands.acts.check import CHECK_BENCH
from labctl.services.commands.registry import CLEAR_BENCH
from labctl.services.commands.requests import ToBench

router = APIRouter(prefix="/api", tags=["catalogue"])


@router.get("/benches", summary="This service's bench")
def benches(service: ServiceDep) -> list[BenchResponse]:
    """The bench that this service runs: its instruments, limits and what it is doing."""
    return service.benches()


@router.get("/benches/status", summary="Benches, and unconfirmed safe states")
def bench_states(service: ServiceDep) -> list[BenchStatus]:
    """Every bench of this database that was used or that a service drives, with what its last safe state could not
    confirm."""
    return bench_statuses(service.store)


@router.post("/stop", summary="Stop the bench")
async def stop(request: ReasonRequest, service: ServiceDep, control: ControlPoolDep) -> StopResponse:
    """Stop whatever runs on this service's bench, now, and keep the bench from moving until a person lets it.

    Status 503 (`not-stopped`) where it is not known within some seconds that the table stands: use the stop switch.
    """
    return await control.run(lambda: service.stop_bench(request.text))


@command_route(router, CLEAR_BENCH, "Record that a bench was inspected")
def clear(bench: str, request: ClearRequest, service: ServiceDep) -> BenchStatus:
    """Record that a person has inspected a bench whose safe state was not confirmed; campaigns may start again."""
    return service.execute(CLEAR_BENCH, ToBench(bench, request))


@command_route(router, CHECK_BENCH, "Check every instrument of the bench")
def check(bench: str, request: CheckRequest, service: ServiceDep) -> BenchCheckResponse:
    """Ask every instrument and port of the bench what it is and how it does, while no campaign runs; nothing moves."""
    return service.execute(CHECK_BENCH, ToBench(bench, request))
