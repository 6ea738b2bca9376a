"""Commands on fleet jobs: start one, cancel it."""

from __future__ import annotations

from dataclasses import dataclass

from labctl.answers.fleet import FleetCancelRequest, FleetJobRequest, FleetJobResponse
from labctl.services.commands.command import Command
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import Addressed
from labctl.services.fleet import jobs


@dataclass(frozen=True)
class ToFleetJob(Addressed):
    """A request for a fleet job."""

    job: int
    body: FleetCancelRequest


def _start(context: CommandContext, request: FleetJobRequest) -> FleetJobResponse:
    jobs.refuse_other_engine(request.engine)
    jobs.refuse_other_source(request.source)
    return jobs.begin(context.store, request, context.now())


def _cancel(context: CommandContext, request: ToFleetJob) -> FleetJobResponse:
    return jobs.cancel(context.store, request.job, request.body, context.now())


START_FLEET_JOB = Command(
    method="POST", path="/api/fleet/jobs", handler=_start, responses={201: FleetJobResponse}
)  # fmt: skip
CANCEL_FLEET_JOB = Command(
    method="POST", path="/api/fleet/jobs/{job}/cancel", handler=_cancel, responses={200: FleetJobResponse}
)
