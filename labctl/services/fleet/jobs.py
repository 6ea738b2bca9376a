"""Jobs over many units: begin, state, cancel, and what came of each unit."""

from __future__ import annotations

from datetime import datetime

from labctl.acting_user import actor
from labctl.answers.fleet import (
    FleetCancelRequest,
    FleetJobRequest,
    FleetJobResponse,
    FleetUnitResponse,
    FleetUnitState,
)
from labctl.answers.storage_url import EXAMPLES, refused_because
from labctl.config import FLEET_ENGINE_VARIABLE, FLEET_SOURCE_VARIABLE, fleet_engine, fleet_source
from labctl.errors import BadInput
from labctl.fitting.models.presets import preset_for
from labctl.services.fleet.engines import LOCAL, refuse_unknown
from labctl.store import FleetCounts, FleetFilter, FleetJobRow, NewFleetJob, Store
from labctl.store.paging import Page, PageRequest
from labctl.store.repositories.fleet_jobs import OPEN


def refuse_other_engine(engine: str) -> None:
    """Raise BadInput for a cluster that this service may not use: what a cluster answers is code to it."""
    allowed = fleet_engine()
    if engine not in {LOCAL, allowed}:
        raise BadInput(
            f"engine {engine!r}: this service may use {' or '.join(filter(None, (LOCAL, allowed)))}; start the service "
            f"with {FLEET_ENGINE_VARIABLE}={engine} to allow it"
        )


def refuse_other_source(source: str) -> None:
    """Raise BadInput for a storage that this service may not read: its URL names a place of the service's computer."""
    allowed = fleet_source()
    if reason := allowed and refused_because(allowed):
        raise BadInput(
            f"{FLEET_SOURCE_VARIABLE} of this service is refused: {reason}; start the service with scheme, place and "
            f"folder only, as {EXAMPLES}"
        )
    if source not in {"", allowed}:
        raise BadInput(
            f"source {source!r}: this service may read {' or '.join(filter(None, ('its database', allowed)))}; start "
            f"the service with {FLEET_SOURCE_VARIABLE}={source} to allow it"
        )


def begin(store: Store, request: FleetJobRequest, at: datetime, runner: str = "") -> FleetJobResponse:
    """Write down a job. `runner` is the process that carries it out at once; empty: the next service does.

    Raises BadInput for an unknown model, effect or engine, NotFound where no unit matches.
    """
    refuse_unknown(request.engine)
    if request.kind == "fit":
        preset_for(request.model or None, list(request.effects))
    elif request.effects:
        raise BadInput("effects are of a fit, and a criticism judges the newest versions as they are; leave them out")
    model = request.model if request.kind == "criticise" else ""
    wanted = FleetFilter(request.type, request.batch, request.supplier, request.search, model)
    new = NewFleetJob(request.kind, request.model_dump(mode="json"), request.engine, actor().name)
    return job_answer(store, store.fleet.begin(new, wanted, runner, at), at)


def cancel(store: Store, job: int, request: FleetCancelRequest, at: datetime) -> FleetJobResponse:
    """Have a job end before it is done; what was written stays. Raises NotFound, Conflict."""
    store.fleet.cancel(job, request.by or actor().name, request.reason, at)
    return job_answer(store, job, at)


def job_answer(store: Store, job: int, now: datetime) -> FleetJobResponse:
    """Return how far a job is. Raises NotFound."""
    return _answer(store.fleet.get(job), store.fleet.counts(job), now)


def job_answers(store: Store, request: PageRequest[int], now: datetime) -> Page[FleetJobResponse, int]:
    """Return jobs, newest first."""
    page = store.fleet.page(request)
    answers = [_answer(row, store.fleet.counts(row.id), now) for row in page.rows]
    return Page(answers, page.total, page.next_after)


def unit_answers(
    store: Store, job: int, request: PageRequest[str], state: FleetUnitState | None = None
) -> Page[FleetUnitResponse, str]:
    """Return what came of the units of a job, by serial number. Raises NotFound."""
    page = store.fleet.units(store.fleet.get(job).id, request, state)
    answers = [
        FleetUnitResponse.model_validate(
            {name: getattr(row, name) for name in FleetUnitResponse.model_fields}, extra="forbid"
        )
        for row in page.rows
    ]
    return Page(answers, page.total, page.next_after)


def _answer(row: FleetJobRow, counts: FleetCounts, now: datetime) -> FleetJobResponse:
    computed = counts.done + counts.failed
    return FleetJobResponse(
        id=row.id,
        kind=row.kind,
        request=FleetJobRequest.model_validate(row.request),
        engine=row.engine,
        by=row.by,
        created_at=row.created_at,
        started_at=row.started_at,
        ended_at=row.ended_at,
        state=row.state,
        ended=row.state not in OPEN,
        why=row.why,
        units=row.units,
        waiting=counts.waiting,
        done=counts.done,
        failed=counts.failed,
        skipped=counts.skipped,
        processor_s=counts.processor_s,
        processor_s_per_unit=counts.processor_s / computed if computed else None,
        left_s=_left_s(row, counts, now),
    )


def _left_s(row: FleetJobRow, counts: FleetCounts, now: datetime) -> float | None:
    """Return the expected time to the end, by the pace since the begin."""
    finished = row.units - counts.waiting
    if row.state != "running" or row.started_at is None or not finished:
        return None
    return (now - row.started_at).total_seconds() / finished * counts.waiting
