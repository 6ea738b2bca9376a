"""Where campaigns are: from rows, and from a running engine's own picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from datetime import timedelta
from typing import Literal

from instruments.bench_config import BenchFile
from labctl.services.schemas.campaigns import CampaignResponse, EventResponse, OutputResponse, PromptResponse
from labctl.store import CampaignRow, EventRow, Store
from procedures.contracts.control import ControlRequest
from procedures.monitoring.progress import Progress

ENDED = frozenset({"done", "aborted", "failed"})


def answer_of(row: CampaignRow, progress: Progress, wish: ControlRequest | None = None) -> CampaignResponse:
    """Return a campaign as its engine sees it, with what a person asked for and the engine has not yet done."""
    state, prompt = progress.state.value, progress.prompt
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
        rate_dps=progress.rate_dps,
        outputs=[] if state in ENDED else [OutputResponse(**asdict(output)) for output in progress.live.outputs()],
        last_error=progress.last_error or None,
        wish=None if wish is None or state in ENDED else _open_wish(wish, state),
        prompt=None if prompt is None else PromptResponse(**asdict(prompt)),
        links=dict(progress.links),
        dropped=dict(progress.dropped),
        started_at=row.started_at,
        ended_at=row.ended_at,
        recordings=dict(row.recordings),
    )


def _open_wish(wish: ControlRequest, state: str) -> Literal["pause", "abort"] | None:
    if wish.abort:
        return "abort"
    return "pause" if wish.pause and state != "paused" else None


def from_rows(store: Store, row: CampaignRow) -> CampaignResponse:
    """Return a campaign as the database tells it."""
    steps = store.campaigns.steps(row.id)
    begun = [step for step in steps if step.started_s is not None]
    done_s = sum(step.expected_s for step in steps if step.state == "done")
    there = store.campaigns.last_environment(row.id) or {}
    current = begun[-1] if begun else None
    left_s = sum(step.expected_s for step in steps if step.state in {"planned", "running"})
    events = store.campaigns.events(row.id, limit=1_000_000)
    faults = [event for event in events if event.level == "error"]
    over = row.state in ENDED
    return CampaignResponse(
        id=row.id,
        recipe=row.recipe_name,
        bench=row.bench_name,
        state=row.state,
        reason=row.reason,
        step=None if current is None else current.number + 1,
        steps=len(steps),
        step_text="" if current is None else current.kind.replace("_", " "),
        progress=1.0 if row.state == "done" else min(done_s / max(row.expected_s, 1e-9), 1.0),
        expected_end=None if over or not events else events[-1].at + timedelta(seconds=left_s),
        t_s=max([there.get("t_s") or 0.0, *(event.t_s for event in events[-1:])]) if events else None,
        chamber_c=there.get("chamber_c"),
        setpoint_c=there.get("chamber_setpoint_c"),
        gyro_c=there.get("temperature_c"),
        rate_dps=None if current is None else current.body.get("rate_dps", 0.0),
        last_error=faults[-1].message if faults else None,
        dropped=store.interruptions.standing(row.id).dropped,
        started_at=row.started_at,
        ended_at=row.ended_at,
        recordings=dict(row.recordings),
    )


def list_campaigns(store: Store) -> list[CampaignResponse]:
    """Return every campaign, newest first."""
    return _told(store, store.campaigns.all)


def campaign_status(store: Store, campaign: int | None) -> CampaignResponse:
    """Return where a campaign is; without a number the newest. Raises NotFound."""
    number = store.campaigns.newest().id if campaign is None else campaign
    return _told(store, lambda: [store.campaigns.get(number)])[0]


def _told(store: Store, read: Callable[[], list[CampaignRow]]) -> list[CampaignResponse]:
    """Return campaigns as the database tells them, those that nobody runs as left.

    Whoever wrote to the database may have ended its campaign after the rows were read and let go before the lock was
    looked at: rows are read again before anything is called left.
    """
    rows = read()
    left = {row.id for row in rows if row.state not in ENDED}
    if left and store.is_held:
        left.clear()
    if left:
        rows = read()
    return [looked_after(from_rows(store, row), by_somebody=row.id not in left) for row in rows]


def abandoned_campaigns(store: Store) -> list[CampaignResponse]:
    """Return the campaigns that no process runs any more and that have not ended, newest first."""
    return [answer for answer in _told(store, store.campaigns.unfinished) if answer.abandoned]


def how_far(answer: CampaignResponse) -> str:
    """Say that a campaign was left, and how far it was."""
    return f"campaign {answer.id} was cut short at {100 * answer.progress:.0f} %"


def describe_interrupted(answer: CampaignResponse) -> str:
    """Say that a campaign was left, and what a person can do about it."""
    takes_up, ends = f"`labctl campaign resume {answer.id}`", f"`labctl campaign abort {answer.id}`"
    return f"{how_far(answer)}; {takes_up} takes it up, {ends} ends it"


def outlives_its_process(row: CampaignRow) -> bool:
    """Return whether a campaign's bench is still there, as it was, when the process that drove it is gone."""
    # the simulation may be another labctl's, whose settings are not known any more
    return not BenchFile.model_validate({**row.bench, "simulation": None}).is_simulated


def looked_after(answer: CampaignResponse, *, by_somebody: bool) -> CampaignResponse:
    """Say so when no process runs a campaign that has not ended."""
    if answer.state in ENDED or by_somebody:
        return answer
    why = answer.reason if answer.state == "interrupted" else "no process runs it any more: look after the bench"
    reason = (
        f"{why}; `labctl campaign resume` or a service on its bench takes it up where it was, `labctl campaign abort` "
        "ends it"
    )
    return answer.model_copy(update={"reason": reason, "abandoned": True})


def event_answer(row: EventRow) -> EventResponse:
    """Return an event as it leaves the house."""
    return EventResponse(
        id=row.id, at=row.at, t_s=row.t_s, kind=row.kind, level=row.level, message=row.message, device=row.device,
        value=row.value, limit=row.limit, unit=row.unit,
    )  # fmt: skip
