"""Running a campaign: from a plan to a campaign in the store, and the engine through it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import Clock, ScaledClock, SystemClock, VirtualClock
from instruments.drivers.unit_handlers import ManualUnitHandler
from instruments.errors import InstrumentError
from instruments.interfaces.gyro import Gyro
from labctl.config import default_database
from labctl.errors import BadInput, Conflict, Stopped, StoreError
from labctl.recording import OutputUnit, RecordingInfo
from labctl.services.benches.host import boot_id
from labctl.services.benches.lease import holding, open_for
from labctl.services.campaigns.status import ENDED, answer_of, describe_interrupted, from_rows
from labctl.services.planning.loading import bench_for, load_bench, load_recipe
from labctl.services.schemas.campaigns import CampaignResponse, StartRequest
from labctl.store import NewCampaign, NewUnit, Store
from labctl.store.connection.database import note_campaign
from procedures.contracts.control import Control
from procedures.contracts.operator import HumanOperator, Operator, UnitHandlerOperator
from procedures.execution.engine import Engine
from procedures.execution.resume import Restart
from procedures.execution.safe_state import stop_table
from procedures.execution.signals import ignore_signals
from procedures.monitoring.progress import Progress
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan

Observe = Callable[[CampaignResponse], None]
Attend = Callable[[Operator, Callable[[str], None]], None]


@dataclass(frozen=True)
class Prepared:
    """A campaign that is written down and may begin."""

    id: int
    plan: Plan
    bench: Bench
    clock: Clock
    operator: Operator
    start_at: int = 0
    restart: Restart | None = None  #: what is known of the interruption that it is taken up after
    start_s: float | None = None  #: the clock's time of campaign time 0; absent: when it begins


def operator_of(bench: Bench) -> Operator:
    """Return who turns and switches the units of a bench."""
    return (
        HumanOperator()
        if isinstance(bench.unit_handler, ManualUnitHandler)
        else UnitHandlerOperator(bench.unit_handler)
    )


def refuse_unconfirmed(store: Store, bench: str) -> None:
    """Raise Conflict while nobody has looked at a bench whose safe state was not confirmed."""
    if text := store.benches.unconfirmed(bench):
        raise Conflict(
            f"bench {bench} was not confirmed safe: {text}. Look at it, then `labctl bench clear {bench} --by NAME`"
        )


def seeded(bench: BenchFile, seed: int | None) -> BenchFile:
    """Return the bench with another seed of its simulation."""
    if seed is None:
        return bench
    simulation = (bench.simulation or SimulationSettings()).model_copy(update={"seed": seed})
    return bench.model_copy(update={"simulation": simulation})


def clock_for(bench: BenchFile, speed: float | None) -> Clock:
    """Return the wall's clock for real instruments; for simulated ones a scaled or a virtual clock.

    Simulators in another process set the pace themselves. Raises BadInput for a speed on a bench that has its own.
    """
    if not bench.is_simulated:
        if speed is not None:
            raise BadInput(f"--speed {speed:g}: bench {bench.name} keeps its own time; leave the option out")
        simulation = bench.simulation
        return ScaledClock(simulation.speed) if simulation is not None and simulation.control else SystemClock()
    return VirtualClock() if speed is None else ScaledClock(speed)


def prepare(
    store: Store, recipe_source: str, bench_file: BenchFile, clock: Clock, *, clip: bool, opened: Bench | None = None
) -> Prepared:
    """Open the bench, plan, and write the whole campaign down; the table is at rest when this returns.

    `opened` is the bench where it is open already.

    Raises InstrumentError when an instrument does not answer, PlanRefused when the bench cannot do the recipe.
    """
    recipe = load_recipe(recipe_source)
    refuse_unconfirmed(store, bench_file.name)
    bench = opened or open_bench(bench_file, clock)
    try:
        bench.table.identify()
        bench.chamber.identify()
        if bench.table.is_moving():  # whoever drove it before was killed: a move goes on without him
            _rest(bench, clock)
        plan = make_plan(recipe, BenchLimits.of(bench), clip=clip)
        units = tuple(_unit(gyro, bench_file, clock) for gyro in bench.gyros.values())
        new = NewCampaign(
            recipe_name=recipe.name,
            recipe=plan.recipe.model_dump(mode="json"),
            bench_name=bench_file.name,
            bench=bench_file.model_dump(mode="json"),
            schedule_hash=plan.schedule_hash,
            expected_s=plan.expected_s,
            steps=[step.model_dump(mode="json") for step in plan.steps],
            units=units,
            boot_id=boot_id(),
        )
        return Prepared(store.campaigns.create(new, clock.utc()), plan, bench, clock, operator_of(bench))
    except BaseException:
        bench.close()
        raise


def _rest(bench: Bench, clock: Clock) -> None:
    if complaint := stop_table(bench.table, clock):
        raise InstrumentError(bench.table.name, complaint)


def _unit(gyro: Gyro, bench: BenchFile, clock: Clock) -> NewUnit:
    identity = gyro.identify()
    latitude = bench.latitude_deg
    info = RecordingInfo(
        serial=identity.serial,
        model=identity.model,
        axes=gyro.axes,
        kind="samples",
        started_at=clock.utc(),
        latitude_deg=latitude,
        sample_rate_hz=gyro.sample_rate_hz,
        max_rate_dps=gyro.limits.max_rate_dps,
        technology=identity.technology or None,
        datasheet=dict(identity.datasheet),
        output={axis: OutputUnit.model_validate(dict(unit)) for axis, unit in identity.output.items()},
    )
    channels = tuple({"name": c.name, "unit": c.unit, "scale": c.scale, "offset": c.offset} for c in gyro.channels)
    return NewUnit(gyro.name, info.model_dump(mode="json"), channels)


def run(
    store: Store, prepared: Prepared, control: Control | None = None, observe: Callable[[Progress], None] | None = None
) -> CampaignResponse:
    """Run a prepared campaign to its end; the bench is closed, in its safe state, when this returns.

    Raises Stopped after a Ctrl-C.
    """
    return _drive(store, prepared, _engine(store, prepared, control, observe))


def _engine(
    store: Store, prepared: Prepared, control: Control | None, observe: Callable[[Progress], None] | None
) -> Engine:
    return Engine(
        prepared.plan,
        prepared.bench,
        store.campaigns.journal(prepared.id),
        prepared.clock,
        prepared.operator,
        control=control or Control(),
        observer=observe,
        start_s=prepared.start_s,
    )


def _drive(store: Store, prepared: Prepared, engine: Engine) -> CampaignResponse:
    try:
        engine.run(prepared.start_at, prepared.restart)
    except KeyboardInterrupt as interrupt:
        raise Stopped(_stopped(store, prepared, engine)) from interrupt
    finally:
        with ignore_signals(), closing(prepared.bench):
            if engine.complaints:  # said in its event already, unless that could not be written
                bench = store.campaigns.get(prepared.id).bench_name
                if not store.benches.unconfirmed(bench):
                    store.benches.mark(bench, "; ".join(engine.complaints), prepared.clock.utc())
    return answer_of(store.campaigns.get(prepared.id), engine.progress)


def describe_safe_state(bench: str, unconfirmed: str) -> str:
    """Say how a bench was left, and what to do where it could not be confirmed safe."""
    if not unconfirmed:
        return f"bench {bench} is safe"
    return (
        f"bench {bench} is NOT confirmed safe: {unconfirmed}; look at it, then `labctl bench clear {bench} --by NAME`"
    )


def _stopped(store: Store, prepared: Prepared, engine: Engine) -> str:
    left = describe_safe_state(store.campaigns.get(prepared.id).bench_name, "; ".join(engine.complaints))
    return f"campaign {prepared.id} was stopped; {left}; `labctl campaign resume {prepared.id}` goes on with it"


def _unwritten(store: Store, campaign: int, bench: str, engine: Engine, error: StoreError) -> str:
    """Say how a campaign ended that could not be written any more, and what is known of its bench."""
    complaints, ended, marked = "; ".join(engine.complaints), False, ""
    with suppress(StoreError):
        ended, marked = store.campaigns.get(campaign).state in ENDED, store.benches.unconfirmed(bench)
    left = describe_safe_state(bench, complaints)
    if complaints and not marked:  # nothing that `labctl bench clear` could take back
        left = f"bench {bench} is NOT confirmed safe, and that could not be written down: {complaints}; look at it"
    elif not complaints and not ended:
        left += ", but that could not be written down"
    return (
        f"campaign {campaign} was cut short: {error.cause}; what was measured before is kept; {left}; once there is "
        f"room again, `labctl campaign resume {campaign}` goes on with it"
    )


def answers_noted(store: Store, prepared: Prepared) -> Callable[[str], None]:
    """Return what writes an answer that was given at this terminal into the audit trail."""

    def note(said: str) -> None:
        at, subject = prepared.clock.utc(), f"campaign {prepared.id}"
        store.audit.record(at, "campaign confirm", subject, {"reason": said})

    return note


def run_here(
    database: str | None,
    request: StartRequest,
    observe: Observe | None = None,
    attend: Attend | None = None,
    say: Callable[[str], None] | None = None,
) -> CampaignResponse:
    """Run a campaign in this process, until it is over; `attend` is given whom the campaign asks.

    `say` is told of a campaign that was left on a simulated bench. Raises Conflict for one on any other bench.
    """
    bench_file = seeded(load_bench(request.bench or bench_for(load_recipe(request.recipe))), request.seed)
    with open_for(bench_file, database or default_database()) as store, holding(store, bench_file) as control:
        clock = clock_for(bench_file, request.speed)
        for text in _left_on(store, bench_file):
            if not bench_file.is_simulated:
                raise Conflict(f"bench {bench_file.name}: {text}; nothing is begun there before")
            if say is not None:
                say(text)
        prepared = prepare(store, request.recipe, bench_file, clock, clip=request.clip)
        return run_attended(store, prepared, control, observe, attend)


def _left_on(store: Store, bench: BenchFile) -> list[str]:
    """Say which campaigns were left on a bench that this process holds."""
    if bench.is_simulated and not store.is_sole_writer:  # it has no lease: another process may run them
        return []
    rows = [row for row in store.campaigns.unfinished() if row.bench_name == bench.name]
    return [describe_interrupted(from_rows(store, row)) for row in rows]


def run_attended(
    store: Store, prepared: Prepared, control: Control, observe: Observe | None, attend: Attend | None
) -> CampaignResponse:
    """Run a prepared campaign to its end at somebody's terminal.

    Raises Stopped after a Ctrl-C, StoreError when it cannot be written any more; both say how the bench was left.
    """
    row = store.campaigns.get(prepared.id)
    note_campaign(store.location, row.id)
    if attend is not None:
        attend(prepared.operator, answers_noted(store, prepared))

    def seen(progress: Progress) -> None:
        if observe is not None:
            observe(answer_of(row, progress))

    engine = _engine(store, prepared, control, seen)
    try:
        return _drive(store, prepared, engine)
    except StoreError as error:
        raise type(error)(_unwritten(store, row.id, row.bench_name, engine, error)) from error
