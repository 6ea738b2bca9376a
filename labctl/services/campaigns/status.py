"""Where campaigns are: from rows, and from a running engine's own picture."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from datetime import timedelta
from typing import Literal

from pydantic import TypeAdapter

from instruments.bench_config import BenchFile
from labctl.services.benches.bench_clock import has_simulated_time
from labctl.services.benches.identity import reported_in
from labctl.services.schemas.campaigns import CampaignResponse, EventResponse
from labctl.services.schemas.reports.campaign_parts import (
    AdviceResponse,
    DriverResponse,
    OutputResponse,
    PromptResponse,
    TurnResponse,
)
from labctl.store import CampaignRow, CampaignSummary, EventRow, Store
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.contracts.control import ControlRequest
from procedures.contracts.journal import NOT_SAFE
from procedures.monitoring.progress import Progress

RESUME = "then resume the campaign"
DID_SAFE = "labctl stopped the table, set the chamber to its safe set point, and kept every data set that was complete."
DID_UNSAFE = (
    "labctl tried to stop the table and to set the chamber to its safe set point, and could not confirm all of it."
)
DID_NOTHING = "labctl did not resume the campaign; every data set that was complete is kept."
LOOK = (
    "Go to the bench, inspect table and chamber, record that with `labctl bench clear` or on the bench page, "
    + RESUME
    + "."
)


@dataclass(frozen=True)
class Failure:
    """One kind of failure, known by the text of its reason."""

    pattern: str
    happened: str
    next: str


#: Kinds of failure by the reason that the engine or the recovery gives; the first that fits counts.
FAILURES: tuple[Failure, ...] = (
    Failure(
        r"not (?:taken up|resumed): bench .* was not confirmed safe",
        "The bench was not confirmed safe when the campaign was to go on.",
        LOOK,
    ),
    Failure(
        r"(?:taken up|resumed) \d+ times without finishing a step",
        "The campaign was resumed several times and never finished a step.",
        f"Find out at the bench what stops the campaign each time, {RESUME}.",
    ),
    Failure(
        r"not (?:taken up|resumed): ",
        "The campaign was interrupted and could not be resumed.",
        f"Correct what the reason names, {RESUME}.",
    ),
    Failure(
        r"could not be made safe first",
        "The campaign was resumed, but the bench could not be made safe first.",
        LOOK,
    ),
    Failure(
        r" declined: ",
        "A person answered that the requested action cannot be done.",
        f"Remove what prevents the action, {RESUME} and answer the campaign's question.",
    ),
    Failure(
        r"^the turn by .* was refused \d+ times",
        "A turn by hand was refused several times.",
        f"Compare the measured angle with the requested angle, check axis, direction and unit, {RESUME} and turn "
        "again.",
    ),
    Failure(
        r"(?:\w+ answered|no answer) within",
        "The bench's question was not answered in time.",
        f"Choose a time when a person is at the bench, {RESUME} and answer the campaign's question.",
    ),
    Failure(
        r"the soak at .* did not settle within",
        "The unit did not settle at its temperature in time.",
        f"Check the air flow around the unit, or allow a longer soak in the recipe, {RESUME}.",
    ),
    Failure(
        r"deg C after .* not within .* of",
        "The chamber did not reach its set point in time.",
        f"Check that the chamber heats and cools and that its door is closed, {RESUME}.",
    ),
    Failure(
        r"set point .* (?:read back|was written, but)",
        "The chamber did not accept the set point that labctl sent.",
        f"Check the controller's panel for a profile, a lock or a limit, {RESUME}.",
    ),
    Failure(
        r": changed by others \(|cannot be taken back",
        "A person changed the chamber at its panel while the campaign needed it.",
        f"Find out who changed it and why; end a profile at the panel, {RESUME}.",
    ),
    Failure(
        r"is set otherwise than before",
        "A unit came back with other settings than it had before.",
        f"Set the unit as it was and save that in the unit, {RESUME}.",
    ),
    Failure(
        r": alarms \(",
        "The chamber's controller reports an alarm.",
        f"Read the alarm at the controller, remove its cause and reset it, {RESUME}.",
    ),
    Failure(
        r"the air is beyond|its own thermometer: ",
        "A temperature passed a limit of the chamber or of a unit.",
        f"Let chamber and unit return to room temperature, find out why the limit was passed, {RESUME}.",
    ),
    Failure(
        r"the air left its set point|is off the air's|differs from the air",
        "The temperature was not steady while readings were taken.",
        f"Check the chamber's door, air flow and controller, {RESUME}.",
    ),
    Failure(
        r" runs .* deg/s instead of|steps took .* instead of|is steady at .* not for the",
        "The table did not turn at the commanded rate.",
        f"Check that the table turns freely and that its cables have enough slack, {RESUME}.",
    ),
    Failure(
        r"still turns|still moves",
        "The table did not come to rest.",
        LOOK,
    ),
    Failure(
        r"readings lost or damaged|readings marked bad|not one of about|none of about|the (?:sample "
        r")?counter on .* (?:does not advance|stands at)",
        "The readings of a unit were missing, damaged or marked bad.",
        f"Check the unit's power, cable and baud rate, {RESUME}.",
    ),
    Failure(
        r"nothing heard|no answer|gave no (?:complete )?answer|no intact |no whole line|no complete "
        r"line|does not answer|link .* broke|"
        r"cannot be opened|no Modbus TCP|reply belongs to another request|not reached again|"
        r"link is gone|the link (?:.* )?was lost|(?:came|arrived) that are no|answered instead of "
        r"unit|reply to request|line was never silent|"
        r"no Modbus instrument|not a Modbus instrument|, no Modbus;|instead of a Modbus reply",
        "An instrument did not answer.",
        f"Check the instrument's power and cable, run `labctl bench check`, {RESUME}.",
    ),
    Failure(
        r"check (?:the )?address(?: and|, or the) driver|not a C4|not the answer of a C4|, serial |is set otherwise|"
        r"is not configured as|readings/s on |has serial number|on USB adapter",
        "The instrument that answered is not the instrument in the bench file.",
        f"Compare the bench file with the bench, {RESUME}.",
    ),
    Failure(
        r"database|disk|could be written|could not be written",
        "The database could not be written.",
        f"Free disk space or repair the database, inspect the bench, {RESUME}.",
    ),
    Failure(
        r"^ended by an error of the program|^[A-Za-z_.]*(Error|Exception)\b",
        "labctl failed because of a fault in labctl itself.",
        f"Report the reason with the version of labctl, inspect the bench, {RESUME}.",
    ),
)
OTHER = Failure("", "A step of the campaign could not be carried out.", f"Correct what the reason names, {RESUME}.")


def advice_of(state: CampaignState, reason: str) -> AdviceResponse | None:
    """Return the advice on a campaign by its reason; None unless it has failed."""
    if state is not CampaignState.FAILED:
        return None
    unsafe = NOT_SAFE in reason
    cause = reason.partition(NOT_SAFE)[0] or reason
    failure = next((each for each in FAILURES if re.search(each.pattern, cause)), OTHER)
    done = DID_UNSAFE if unsafe else DID_NOTHING if re.search("taken up|resumed", cause) else DID_SAFE
    return AdviceResponse(happened=failure.happened, done=done, next=LOOK if unsafe else failure.next)


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
    current, there = seen.current, seen.environment
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
        t_s=None if seen.last_t_s is None else max(there.t_s or 0.0, seen.last_t_s),
        chamber_c=there.chamber_c,
        setpoint_c=there.setpoint_c,
        gyro_c=there.temperature_c,
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


def list_campaigns(store: Store) -> list[CampaignResponse]:
    """Return every campaign, newest first."""
    return _statuses(store, store.campaigns.all)


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
    left = {row.id for row in rows if row.state not in ENDED}
    if left and store.is_held:
        left.clear()
    if left:
        rows = read()
    return [mark_abandoned(answer, attended=answer.id not in left) for answer in statuses_of(store, rows)]


def abandoned_campaigns(store: Store) -> list[CampaignResponse]:
    """Return the campaigns that no process runs any more and that have not ended, newest first."""
    return [answer for answer in _statuses(store, store.campaigns.unfinished) if answer.abandoned]


def how_far(answer: CampaignResponse) -> str:
    """Say that a campaign was left, and how far it was."""
    return f"campaign {answer.id} was interrupted at {100 * answer.progress:.0f} %"


def describe_interrupted(answer: CampaignResponse) -> str:
    """Say that a campaign was left, and what a person can do about it."""
    resumes, ends = f"`labctl campaign resume {answer.id}`", f"`labctl campaign abort {answer.id}`"
    return f"{how_far(answer)}; {resumes} resumes the campaign, {ends} ends it"


def outlives_its_process(row: CampaignRow) -> bool:
    """Return whether a campaign's bench is still there, as it was, when the process that drove it is gone."""
    # the simulation may be that of another version of labctl, whose settings are not known any more
    return not BenchFile.model_validate({**row.bench, "simulation": None}).is_simulated


def mark_abandoned(answer: CampaignResponse, *, attended: bool) -> CampaignResponse:
    """Return the status, marked as abandoned when no process runs a campaign that has not ended."""
    if answer.state in ENDED or attended:
        return answer
    left_safe = answer.state is CampaignState.INTERRUPTED
    why = answer.reason if left_safe else "no process runs the campaign any more: inspect the bench"
    reason = (
        f"{why}; `labctl campaign resume` or a service on its bench resumes the campaign where it stopped, "
        "`labctl campaign abort` ends it"
    )
    return answer.model_copy(update={"reason": reason, "abandoned": True, "active": False})


def event_answer(row: EventRow) -> EventResponse:
    """Return the response of an event."""
    return EventResponse(
        id=row.id, at=row.at, t_s=row.t_s, kind=row.kind, level=row.level, message=row.message, device=row.device,
        value=row.value, limit=row.limit, unit=row.unit,
    )  # fmt: skip
