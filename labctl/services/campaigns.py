"""Where campaigns are: from rows, and from a running engine's own picture."""

from __future__ import annotations

from dataclasses import asdict
from datetime import timedelta
from typing import Literal

from labctl.services.answers import CampaignAnswer, EventAnswer, OutputAnswer, PromptAnswer
from labctl.store import CampaignRow, EventRow, Store
from procedures.control import Wish
from procedures.progress import Progress

ENDED = frozenset({"done", "aborted", "failed"})


def answer_of(row: CampaignRow, progress: Progress, wish: Wish | None = None) -> CampaignAnswer:
    """Return a campaign as its engine sees it, with what a person asked for and the engine has not yet done."""
    state, prompt = progress.state.value, progress.prompt
    return CampaignAnswer(
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
        outputs=[] if state in ENDED else [OutputAnswer(**asdict(output)) for output in progress.live.outputs()],
        last_error=progress.last_error or None,
        wish=None if wish is None or state in ENDED else _open_wish(wish, state),
        prompt=None if prompt is None else PromptAnswer(**asdict(prompt)),
        links=dict(progress.links),
        dropped=dict(progress.dropped),
        started_at=row.started_at,
        ended_at=row.ended_at,
        recordings=dict(row.recordings),
    )


def _open_wish(wish: Wish, state: str) -> Literal["pause", "abort"] | None:
    if wish.abort:
        return "abort"
    return "pause" if wish.pause and state != "paused" else None


def from_rows(store: Store, row: CampaignRow) -> CampaignAnswer:
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
    return CampaignAnswer(
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


def list_campaigns(store: Store) -> list[CampaignAnswer]:
    """Return every campaign, newest first."""
    return [looked_after(from_rows(store, row), by_somebody=store.is_held) for row in store.campaigns.all()]


def campaign_status(store: Store, campaign: int | None) -> CampaignAnswer:
    """Return where a campaign is; without a number the newest. Raises NotFound."""
    row = store.campaigns.newest() if campaign is None else store.campaigns.get(campaign)
    return looked_after(from_rows(store, row), by_somebody=store.is_held)


def looked_after(answer: CampaignAnswer, *, by_somebody: bool) -> CampaignAnswer:
    """Say so when no process runs a campaign that has not ended."""
    if answer.state in ENDED or by_somebody:
        return answer
    why = answer.reason if answer.state == "interrupted" else "no process runs it any more: look after the bench"
    reason = (
        f"{why}; `labctl campaign resume` or a service on its bench takes it up where it was, `labctl campaign abort` "
        "ends it"
    )
    return answer.model_copy(update={"reason": reason, "abandoned": True})


def event_answer(row: EventRow) -> EventAnswer:
    """Return an event as it leaves the house."""
    return EventAnswer(
        id=row.id, at=row.at, t_s=row.t_s, kind=row.kind, level=row.level, message=row.message, device=row.device,
        value=row.value, limit=row.limit, unit=row.unit,
    )  # fmt: skip
