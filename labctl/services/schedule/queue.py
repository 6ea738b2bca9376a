"""The schedule as a person sees it: enter a start, look, cancel."""

from __future__ import annotations

from datetime import datetime

from instruments.bench_config import BenchFile
from labctl.answers.campaigns import CampaignRequest
from labctl.answers.schedule import ScheduledResponse, StartEventResponse
from labctl.errors import BadInput
from labctl.services.benches.start_confirmation import confirmation_text
from labctl.services.benches.stop_rules import check_stop_on
from labctl.services.planning.attendance import attendance, visits_s
from labctl.services.planning.earlier_campaigns import times_on_bench
from labctl.services.planning.loading import limits_of, load_recipe
from labctl.services.schedule import times
from labctl.services.schedule.scheduler import REAL_BENCH_LATE_LIMIT_S
from labctl.services.simulation.hidden_effects import with_hidden_effects
from labctl.store import NewStart, StartRow, Store
from procedures.planning.plan import make_plan

NO_SERVICE = "no service runs: the campaign is started only while `labctl serve` holds this database with bench {bench}"


def is_scheduled(request: CampaignRequest) -> bool:
    """Return whether a request is for later. Raises BadInput for one that contradicts itself."""
    if request.at is not None and request.cron is not None:
        raise BadInput("a scheduled start has either a time or a cron line; leave one of the two out")
    if request.at is not None or request.cron is not None:
        return True
    given_options = [name for name in ("time_zone", "priority", "late_limit_s") if name in request.model_fields_set]
    if given_options:
        raise BadInput(
            f"{', '.join(given_options)}: only a scheduled start has this option; give a time or a cron line, or leave "
            "the option out"
        )
    return False


def add_start(store: Store, request: CampaignRequest, bench: BenchFile, now: datetime) -> ScheduledResponse:
    """Enter a campaign into the schedule of a bench.

    What can be known now is refused now: raises BadInput for its time, RecipeError, PlanRefused, and
    StartNotConfirmed where no person has confirmed that a real bench will be clear then.
    """
    zone = times.time_zone(request.time_zone)
    if request.cron is not None:
        due = times.check_cron(request.cron, zone, now)
    else:
        assert request.at is not None
        due = times.moment(request.at, zone, now)
    recipe = load_recipe(request.recipe)
    with_hidden_effects(bench, request.hide)  # what cannot be hidden is refused now
    earlier = times_on_bench(store, bench)
    plan = make_plan(recipe, limits_of(bench, driven=True, earlier=earlier), clip=request.clip)
    check_stop_on(plan, bench)
    confirmed = confirmation_text(bench, request)
    new = NewStart(
        bench_name=bench.name, recipe_name=recipe.name, recipe=request.recipe, clip=request.clip,
        priority=request.priority, cron=request.cron, time_zone=zone.key, late_limit_s=request.late_limit_s, due_at=due,
        confirmed_by=request.confirmed_by.strip() if confirmed else None, visits_s=visits_s(plan, bench),
        hide=tuple(request.hide) or None, fit=request.fit,
    )  # fmt: skip
    row = store.starts.get(store.starts.add(new, now))
    assumed = request.time_zone is None and (request.cron is not None or not _has_zone(request.at))
    return _answer(
        store, row, note=f"no time zone was given: {zone.key}, that of this computer, was used" if assumed else ""
    )


def _has_zone(at: str | None) -> bool:
    return at == times.NOW or (at is not None and datetime.fromisoformat(at).tzinfo is not None)


def list_starts(store: Store, *, ended: bool) -> list[ScheduledResponse]:
    """Return what waits to begin, next first, and what was missed and not removed; with `ended` also what is over."""
    return [_answer(store, row) for row in store.starts.all(ended=ended)]


def start_status(store: Store, start: int) -> ScheduledResponse:
    """Return one entry of the schedule with the outcome of its starts. Raises NotFound."""
    return _answer(store, store.starts.get(start))


def cancel_start(store: Store, start: int, now: datetime) -> ScheduledResponse:
    """Take an entry that waits or was missed out of the schedule; a campaign that it has begun runs on.

    Raises NotFound, Conflict.
    """
    store.starts.cancel(start, now)
    return start_status(store, start)


def _missed_after_s(row: StartRow) -> float | None:
    """Return the limit that holds for an entry; only entries of a real bench carry a confirmation."""
    if row.late_limit_s is not None:
        return row.late_limit_s
    return REAL_BENCH_LATE_LIMIT_S if row.confirmed_by else None


def _answer(store: Store, row: StartRow, note: str = "") -> ScheduledResponse:
    zone = times.time_zone(row.time_zone)
    waits = row.state == "waiting"
    return ScheduledResponse(
        id=row.id, bench=row.bench_name, recipe=row.recipe_name, state=row.state,
        due_at=row.due_at.astimezone(zone) if waits else None, time_zone=row.time_zone, cron=row.cron,
        priority=row.priority, clip=row.clip, hide=list(row.hide or ()), fit=row.fit,
        late_limit_s=row.late_limit_s, missed_after_s=_missed_after_s(row), created_at=row.created_at, note=note,
        history=[
            StartEventResponse(
                at=event.at, due_at=event.due_at.astimezone(zone), outcome=event.outcome, message=event.message,
                campaign=event.campaign,
            )
            for event in store.starts.events(row.id)
        ],
        confirmed_by=row.confirmed_by or "",
        attendance=attendance(row.visits_s or (), row.due_at, zone) if waits else None,
    )  # fmt: skip
