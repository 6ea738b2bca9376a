"""Executing a prepared campaign: the engine, its end, and a campaign in the foreground of this process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing, suppress
from dataclasses import replace
from pathlib import Path

from instruments.bench_config import BenchFile
from instruments.clock import WallClock
from instruments.transport.wire_log.recorder import WireRecorder
from labctl.acting_user import actor
from labctl.answers.campaigns import BENCH_CHECKS, CampaignResponse, StartRequest
from labctl.answers.wire_logs import RecordedSession
from labctl.config import default_database
from labctl.errors import Conflict, DatabaseUnreachable, DiskFull, Stopped, StoreError
from labctl.log import get_logger
from labctl.log.context import for_campaign
from labctl.log.logged_journal import LoggedJournal
from labctl.services.benches.confirmation import SafeStateRetry, describe_safe_state
from labctl.services.benches.lease import holding, open_for
from labctl.services.benches.pace import with_pace_watch
from labctl.services.benches.standards import overdue_events, standards_of
from labctl.services.benches.start_confirmation import confirmation_text, start_questions
from labctl.services.benches.wire_log import recording
from labctl.services.campaigns.bench_lending import BenchLending, lending_journal
from labctl.services.campaigns.preparation import (
    Prepared,
    clock_for,
    on_date,
    prepare,
    refuse_unconfirmed,
    seeded,
)
from labctl.services.campaigns.readings_digest import readings_digest
from labctl.services.campaigns.recorded_operator import RecordedOperator
from labctl.services.campaigns.status import answer_of, describe_interrupted, from_rows
from labctl.services.campaigns.stop_socket import answering_stops, let_move, note_carried_out
from labctl.services.planning.loading import bench_for, load_bench, load_recipe, own_text
from labctl.services.simulation.hidden_effects import with_hidden_effects
from labctl.services.standards.agreement import register_events
from labctl.store import Store
from labctl.store.connection.writer_lock import note_campaign
from procedures.contracts.campaign_state import ENDED
from procedures.contracts.control import Control
from procedures.contracts.operator import Operator
from procedures.contracts.sufficiency import SufficiencyMonitor
from procedures.execution.engine import Engine
from procedures.execution.signals import ignore_signals, signals_were_obeyed
from procedures.execution.stoppable_clock import stoppable
from procedures.monitoring.progress import Progress

log = get_logger()

Observe = Callable[[CampaignResponse], None]
Attend = Callable[[Operator, Callable[[str], None]], None]
#: Asks the person at the terminal; returns who has confirmed everything, empty for a no.
AskClear = Callable[[Mapping[str, str]], str]


def run(
    store: Store,
    prepared: Prepared,
    control: Control | None = None,
    observe: Callable[[Progress], None] | None = None,
    lending: BenchLending | None = None,
) -> CampaignResponse:
    """Run a prepared campaign to its end; the bench is closed, in its safe state, when this returns.

    With `lending` the bench is lent to other threads while the engine writes. Raises Stopped after a Ctrl-C.
    """
    if lending is None:
        return _drive(store, prepared, _engine(store, prepared, control, observe))
    with lending.driving():
        return _drive(store, prepared, _engine(store, prepared, control, observe, lending))


def _engine(
    store: Store,
    prepared: Prepared,
    control: Control | None,
    observe: Callable[[Progress], None] | None,
    lending: BenchLending | None = None,
) -> Engine:
    row = store.campaigns.get(prepared.id)
    bench = row.bench_file
    today = prepared.clock.utc().date()
    serials = {gyro.name: gyro.serial for gyro in bench.gyros}
    journal = LoggedJournal(store.campaigns.journal(prepared.id), prepared.id, row.bench_name, prepared.plan, serials)
    return Engine(
        prepared.plan,
        prepared.bench,
        journal if lending is None else lending_journal(journal, lending),
        prepared.clock,
        prepared.operator,
        control=control or Control(),
        observer=with_pace_watch(prepared.clock, observe),
        time=prepared.time,
        sufficiency=sufficiency_of(store, prepared, is_simulated=bench.is_simulated),
        passing=(DatabaseUnreachable,),
        notices=(*overdue_events(bench.standards, today), *register_events(store, standards_of(bench), today)),
    )


def sufficiency_of(store: Store, prepared: Prepared, *, is_simulated: bool) -> SufficiencyMonitor | None:
    """Return what says when a campaign has measured enough; None where its recipe does not ask for that."""
    rules = prepared.plan.recipe.stop
    if rules is None:
        return None
    from labctl.services.sufficiency.in_process import InOwnProcess  # noqa: PLC0415  it loads the libraries of the fit
    from labctl.services.sufficiency.monitor import InThisThread, UncertaintyMonitor  # noqa: PLC0415  as above

    source = InThisThread(store, prepared.id) if is_simulated else InOwnProcess(store.location, prepared.id)
    return UncertaintyMonitor(source, prepared.plan.fitted_datasets, rules.u_dps)


def _drive(store: Store, prepared: Prepared, engine: Engine) -> CampaignResponse:
    """Run the engine and close the bench; once the engine ends, no further signal keeps its end from being reported."""
    bench = store.campaigns.get(prepared.id).bench_name
    with ExitStack() as until_reported:
        until_reported.enter_context(for_campaign(prepared.id, bench))
        until_reported.callback(engine.close)
        try:
            engine.run(prepared.start_at, prepared.restart, lambda: until_reported.enter_context(ignore_signals()))
        except KeyboardInterrupt as interrupt:
            signals_were_obeyed()  # a later one would tear the database off while it is closed
            raise Stopped(_stopped(store, prepared, engine)) from interrupt
        finally:
            with closing(prepared.bench):
                if engine.complaints:  # said in its event already, unless that could not be written
                    log.error("bench.unconfirmed", unconfirmed=list(engine.complaints))
                    if not store.benches.unconfirmed(bench):
                        store.benches.mark(bench, "; ".join(engine.complaints), prepared.clock.utc())
    return answer_of(store.campaigns.get(prepared.id), engine.progress)


def _stopped(store: Store, prepared: Prepared, engine: Engine) -> str:
    state_text = describe_safe_state(store.campaigns.get(prepared.id).bench_name, "; ".join(engine.complaints))
    return f"campaign {prepared.id} was stopped; {state_text}; `labctl campaign resume {prepared.id}` continues it"


def _unwritten(store: Store, campaign: int, bench: str, engine: Engine, error: StoreError) -> str:
    """Describe the end of a campaign that could not be written, and the state of its bench."""
    complaints, ended, marked = "; ".join(engine.complaints), False, ""
    with suppress(StoreError):
        ended, marked = store.campaigns.get(campaign).state in ENDED, store.benches.unconfirmed(bench)
    state_text = describe_safe_state(bench, complaints)
    if complaints and not marked:  # nothing that `labctl bench clear` could take back
        state_text = (
            f"bench {bench} is NOT confirmed safe, and that could not be recorded: {complaints}; inspect the bench"
        )
    elif not complaints and not ended:
        state_text += ", but that could not be recorded"
    again = "there is free space again" if isinstance(error, DiskFull) else "the database can be written again"
    return (
        f"campaign {campaign} was interrupted: {error.cause}; the data measured before are stored; {state_text}; once "
        f"{again}, "
        f"`labctl campaign resume {campaign}` continues it"
    )


def answers_noted(store: Store, prepared: Prepared) -> Callable[[str], None]:
    """Return a function that writes an answer given at this terminal into the audit trail."""

    def note(text: str) -> None:
        at, subject = prepared.clock.utc(), f"campaign {prepared.id}"
        store.audit.record(at, "campaign confirm", subject, {"reason": text})

    return note


def run_here(
    database: str | None,
    request: StartRequest,
    observe: Observe | None = None,
    attend: Attend | None = None,
    say: Callable[[str], None] | None = None,
    ask_clear: AskClear | None = None,
    wire_log: Path | None = None,
    bench: BenchFile | None = None,
) -> CampaignResponse:
    """Run a campaign in this process, until it is over; `attend` is given the operator that it asks.

    `bench` is its bench, where that is not one by file or name. `say` is called with the text about a campaign that was
    left on a simulated bench. `ask_clear` is given the questions about a real bench that is not confirmed to be clear
    yet, and returns who has confirmed it. `wire_log` is the file that gets every byte between labctl and the bench.
    Raises Conflict for a campaign that was left on a real bench, StartNotConfirmed where no person has confirmed that
    it is clear.
    """
    bench_file = seeded(bench or load_bench(request.bench or bench_for(load_recipe(request.recipe))), request.seed)
    bench_file = with_hidden_effects(on_date(bench_file, request.simulated_start), request.hide)
    with open_for(bench_file, database or default_database()) as store, holding(store, bench_file) as control:
        clock = clock_for(bench_file, request.speed, request.simulated_start)
        SafeStateRetry(store, bench_file, lambda: clock).attempt()
        for text in _left_on(store, bench_file):
            if not bench_file.is_simulated:
                raise Conflict(
                    f"bench {bench_file.name}: {text}; inspect the bench, then run `labctl bench "
                    "clear` before a campaign starts"
                )
            if say is not None:
                say(text)
        refuse_unconfirmed(store, bench_file.name)
        questions = start_questions(bench_file)
        if questions and not request.confirmed_by and ask_clear is not None and (by := ask_clear(questions)):
            request = request.model_copy(update={"confirmed_by": by, "checks": list(BENCH_CHECKS)})
        clear = confirmation_text(bench_file, request)
        let_move(store, bench_file.name, request.confirmed_by or actor().name, WallClock().utc())
        clock = stoppable(clock, control)
        with recording(wire_log, bench_file, clock, _session(request)) as recorded:
            wire = None if recorded is None else recorded.wire
            prepared = prepare(
                store, request.recipe, bench_file, clock, clip=request.clip, fit=request.fit, bench_clear=clear,
                wire=wire,
            )  # fmt: skip
            answer = run_attended(store, prepared, control, observe, attend, wire)
            if recorded is not None:
                recorded.result.state = answer.state.value
                recorded.result.readings = readings_digest(store, answer.id)
            return answer


def _session(request: StartRequest) -> RecordedSession:
    """Return what a wire log says of a campaign, so that it can be run again."""
    return RecordedSession(kind="campaign", recipe=own_text(request.recipe), clip=request.clip, fit=request.fit)


def _left_on(store: Store, bench: BenchFile) -> list[str]:
    """Return which campaigns were left on a bench that this process holds."""
    if bench.is_simulated and not store.is_sole_writer:  # it has no lease: another process may run them
        return []
    rows = [row for row in store.campaigns.unfinished() if row.bench_name == bench.name]
    return [describe_interrupted(from_rows(store, row)) for row in rows]


def run_attended(
    store: Store,
    prepared: Prepared,
    control: Control,
    observe: Observe | None,
    attend: Attend | None,
    wire: WireRecorder | None = None,
) -> CampaignResponse:
    """Run a prepared campaign to its end at a terminal; `wire` records the answers of a person.

    Raises Stopped after a Ctrl-C, StoreError when it cannot be written any more; both say how the bench was left.
    """
    row = store.campaigns.get(prepared.id)
    note_campaign(store.location, row.id)
    if attend is not None:
        attend(prepared.operator, answers_noted(store, prepared))
    if wire is not None and not prepared.operator.at_once:
        prepared = replace(prepared, operator=RecordedOperator(prepared.operator, wire.note))

    observer = None if observe is None else lambda progress: observe(answer_of(row, progress))
    engine = _engine(store, prepared, control, observer)
    bench = row.bench_file
    try:
        with answering_stops(store, bench, row.id, control):
            try:
                return _drive(store, prepared, engine)
            finally:
                note_carried_out(store, row.bench_name, WallClock().utc())
    except StoreError as error:
        raise type(error)(_unwritten(store, row.id, row.bench_name, engine, error)) from error
