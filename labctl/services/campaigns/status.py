"""Where campaigns are: from rows, and from a running engine's own picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import timedelta
from typing import Literal

from pydantic import TypeAdapter

from labctl.answers.campaign_parts import (
    DriverResponse,
    OutputResponse,
    PromptResponse,
    TurnResponse,
    WatchedLimitResponse,
)
from labctl.answers.campaigns import CampaignResponse, EventResponse
from labctl.probability_text import share_text
from labctl.services.benches.bench_clock import has_simulated_time
from labctl.services.benches.driving_process import driven_benches
from labctl.services.benches.identity import reported_in
from labctl.services.campaigns.failure_advice import advice_of
from labctl.store import CampaignRow, CampaignSummary, EventRow, Store
from labctl.store.paging import Page, PageRequest
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.contracts.control import ControlRequest
from procedures.monitoring.progress import Progress

_DRIVERS = TypeAdapter(dict[str, DriverResponse])


def answer_of(row: CampaignRow, progress: Progress, request: ControlRequest | None = None) -> CampaignResponse:
    """Return a campaign as its engine sees it, with what a person asked for and the engine has not yet done."""
    state, prompt = progress.state, progress.prompt
    return CampaignResponse(
        id=row.id,
        recipe=row.recipe_name,
        bench=row.bench_name,
        state=state,
        reason=progress.reason,
        step=progress.step,
        steps=progress.steps,
        step_text=progress.step_text,
        progress=progress.fraction,
        expected_end=progress.expected_end,
        t_s=progress.t_s,
        chamber_c=progress.chamber_c,
        setpoint_c=progress.setpoint_c,
        gyro_c=next(iter(progress.gyro_c.values()), None),
        references=dict(progress.references),
        rate_dps=progress.rate_dps,
        outputs=[] if state in ENDED else [OutputResponse(**asdict(output)) for output in progress.live.outputs()],
        last_error=progress.last_error or None,
        repeated=progress.repeated,
        stalled_s=progress.stalled_s,
        wish=None if request is None or state in ENDED else _open_request(request, state),
        prompt=None if prompt is None else PromptResponse(**asdict(prompt)),
        turn=None if progress.turn is None else TurnResponse(**asdict(progress.turn)),
        links=dict(progress.links),
        limits=[] if state in ENDED else [WatchedLimitResponse(**asdict(each)) for each in progress.limits],
        dropped=dict(progress.dropped),
        started_at=row.started_at,
        ended_at=row.ended_at,
        recordings=dict(row.recordings),
        drivers=_drivers(row),
        reported=reported_in(row),
        simulated_time=has_simulated_time(row.bench),
        advice=advice_of(state, progress.reason),
    )


def _drivers(row: CampaignRow) -> dict[str, DriverResponse]:
    """Return which release drove each instrument; empty for a campaign before drivers were recorded."""
    return _DRIVERS.validate_python(row.bench.get("drivers", {}))


def _open_request(request: ControlRequest, state: CampaignState) -> Literal["pause", "abort"] | None:
    if request.abort:
        return "abort"
    return "pause" if request.pause and state is not CampaignState.PAUSED else None


def from_rows(store: Store, row: CampaignRow) -> CampaignResponse:
    """Return a campaign as the database tells it."""
    return statuses_of(store, [row])[0]


def statuses_of(store: Store, rows: Sequence[CampaignRow]) -> list[CampaignResponse]:
    """Return campaigns as the database tells them, in the order of the rows."""
    summaries = store.campaigns.summaries([row.id for row in rows])
    return [_from_summary(row, summaries[row.id]) for row in rows]


def _from_summary(row: CampaignRow, seen: CampaignSummary) -> CampaignResponse:
    current, environment = seen.current, seen.environment
    over = row.state in ENDED
    return CampaignResponse(
        id=row.id,
        recipe=row.recipe_name,
        bench=row.bench_name,
        state=row.state,
        reason=row.reason,
        step=None if current is None else current.number + 1,
        steps=seen.steps,
        step_text="" if current is None else current.kind.replace("_", " "),
        progress=1.0 if row.state is CampaignState.DONE else min(seen.done_s / max(row.expected_s, 1e-9), 1.0),
        expected_end=None if over or seen.last_at is None else seen.last_at + timedelta(seconds=seen.left_s),
        t_s=None if seen.last_t_s is None else max(environment.t_s or 0.0, seen.last_t_s),
        chamber_c=environment.chamber_c,
        setpoint_c=environment.setpoint_c,
        gyro_c=environment.temperature_c,
        rate_dps=None if current is None else current.body.get("rate_dps", 0.0),
        last_error=seen.last_error,
        repeated=seen.repeated,
        stalled_s=seen.stalled_s,
        dropped=dict(seen.dropped),
        started_at=row.started_at,
        ended_at=row.ended_at,
        recordings=dict(row.recordings),
        drivers=_drivers(row),
        reported=reported_in(row),
        simulated_time=has_simulated_time(row.bench),
        advice=advice_of(row.state, row.reason),
    )


def page_of_campaigns(store: Store, request: PageRequest[int]) -> Page[CampaignResponse, int]:
    """Return campaigns, newest first, as many as are asked for."""
    pages: list[Page[CampaignRow, int]] = []

    def read() -> list[CampaignRow]:
        pages.append(store.campaigns.page(request))
        return pages[-1].rows

    answers = _statuses(store, read)
    return Page(answers, pages[-1].total, pages[-1].next_after)


def campaign_status(store: Store, campaign: int | None) -> CampaignResponse:
    """Return where a campaign is; without a number the newest. Raises NotFound."""
    number = store.campaigns.newest().id if campaign is None else campaign
    return _statuses(store, lambda: [store.campaigns.get(number)])[0]


def _statuses(store: Store, read: Callable[[], list[CampaignRow]]) -> list[CampaignResponse]:
    """Return campaigns as the database tells them; those that no process runs are marked as abandoned.

    The writing process may have ended its campaign after the rows were read, and released the lock before it was
    tested: rows are read again before a campaign is called abandoned.
    """
    rows = read()
    left = _unattended(store, rows)
    if left:
        rows = read()
    return [mark_abandoned(answer, attended=answer.id not in left) for answer in statuses_of(store, rows)]


def _unattended(store: Store, rows: Sequence[CampaignRow]) -> set[int]:
    """Return the campaigns that have not ended and that no process runs."""
    unfinished = {row.id: row.bench_name for row in rows if row.state not in ENDED}
    if not unfinished:
        return set()
    if store.is_shared:
        driven = driven_benches(store)
        return {campaign for campaign, bench in unfinished.items() if bench not in driven}
    return set() if store.is_held else set(unfinished)


def abandoned_campaigns(store: Store) -> list[CampaignResponse]:
    """Return the campaigns that no process runs any more and that have not ended, newest first."""
    return [answer for answer in _statuses(store, store.campaigns.unfinished) if answer.abandoned]


def how_far(answer: CampaignResponse) -> str:
    """Describe how far an interrupted campaign was."""
    return f"campaign {answer.id} was interrupted at {share_text(answer.progress)}"


def describe_interrupted(answer: CampaignResponse) -> str:
    """Describe an interrupted campaign and what a person can do about it."""
    resumes, ends = f"`labctl campaign resume {answer.id}`", f"`labctl campaign abort {answer.id}`"
    return f"{how_far(answer)}; {resumes} resumes the campaign, {ends} ends it"


def outlives_its_process(row: CampaignRow) -> bool:
    """Return whether a campaign's bench is still there, as it was, when the process that drove it is gone."""
    return not row.bench_file.is_simulated


def mark_abandoned(answer: CampaignResponse, *, attended: bool) -> CampaignResponse:
    """Return the status, marked as abandoned when no process runs a campaign that has not ended."""
    if answer.state in ENDED or attended:
        return answer
    left_safe = answer.state is CampaignState.INTERRUPTED
    cause = answer.reason if left_safe else "no process runs the campaign any more: inspect the bench"
    reason = (
        f"{cause}; `labctl campaign resume` or a service on its bench resumes the campaign where it stopped, "
        "`labctl campaign abort` ends it"
    )
    return answer.model_copy(update={"reason": reason, "abandoned": True, "active": False})


def event_answer(row: EventRow) -> EventResponse:
    """Return the response of an event."""
    return EventResponse(
        id=row.id, at=row.at, t_s=row.t_s, kind=row.kind, level=row.level, message=row.message, device=row.device,
        value=row.value, limit=row.limit, unit=row.unit,
    )  # fmt: skip
