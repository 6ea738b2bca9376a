"""Preparing a campaign: open the bench, plan, and write the campaign down before anything moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import VIRTUAL_START, Clock, PacedClock, registered
from instruments.configuration import configuration_of
from instruments.drivers.unit_handlers import ManualUnitHandler
from instruments.errors import InstrumentError
from instruments.interfaces.gyro import Gyro, GyroIdentity
from instruments.interfaces.table import RateTable
from instruments.shared_clock import clock_outside
from instruments.standards import Standard
from instruments.transport.factory import Wire
from labctl.acting_user import actor
from labctl.answers.raw_channels import RawChannelJson
from labctl.errors import BadInput, Conflict
from labctl.log import get_logger
from labctl.recording import RecordingInfo
from labctl.services.benches.confirmation import describe_bench
from labctl.services.benches.identity import refuse_changed, refuse_otherwise_set, reported_of
from labctl.services.benches.power_failure import boot_id
from labctl.services.benches.reference_columns import (
    raw_channel,
    reference_channels,
    reference_notes,
    refuse_doubled_columns,
    temperature_instrument,
)
from labctl.services.benches.standards import standards_of
from labctl.services.benches.stop_rules import check_stop
from labctl.services.planning.earlier_campaigns import times_on_bench
from labctl.services.planning.loading import load_recipe, with_drivers
from labctl.services.planning.timeline import step_json
from labctl.services.standards.agreement import as_used, refuse_bad
from labctl.store import NewCampaign, NewUnit, Store
from labctl.store.sample_codec import load_compressor
from procedures.contracts.operator import HumanOperator, Operator, UnitHandlerOperator
from procedures.execution.resume import Restart
from procedures.execution.safe_state import stop_table
from procedures.monitoring.campaign_time import CampaignTime
from procedures.planning.earlier_times import EarlierTimes
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe

log = get_logger()
#: A unit whose supply was just switched on is asked after this, s.
START_UP_S = 5.0


@dataclass(frozen=True)
class Prepared:
    """A campaign that is written down and may begin."""

    id: int
    plan: Plan
    bench: Bench
    clock: Clock
    operator: Operator
    start_at: int = 0
    restart: Restart | None = None  #: what is known of the interruption after which it is resumed
    time: CampaignTime | None = None  #: of a resumed campaign; absent: time 0 is when it begins


def operator_of(bench: Bench) -> Operator:
    """Return who turns and switches the units of a bench."""
    return (
        HumanOperator()
        if isinstance(bench.unit_handler, ManualUnitHandler)
        else UnitHandlerOperator(bench.unit_handler)
    )


def _runnable(recipe: Recipe, *, fit: bool) -> Recipe:
    """Return a recipe, without [fit] where none is wanted."""
    return recipe if fit else recipe.model_copy(update={"fit": None})


def refuse_unconfirmed(store: Store, bench: str) -> None:
    """Raise Conflict while a bench whose safe state was not confirmed has not been checked by a person."""
    row = store.benches.get(bench)
    if row is None or not row.unconfirmed:
        return
    if row.confirmed_at is not None:
        raise Conflict(describe_bench(row))
    tried = f" (tried again {row.attempts} times)" if row.attempts else ""
    raise Conflict(
        f"bench {bench} was not confirmed safe{tried}: {row.unconfirmed}. Inspect the bench, then run `labctl "
        f"bench clear {bench} --by NAME`"
    )


def seeded(bench: BenchFile, seed: int | None) -> BenchFile:
    """Return the bench with another seed of its simulation."""
    if seed is None:
        return bench
    simulation = (bench.simulation or SimulationSettings()).model_copy(update={"seed": seed})
    return bench.model_copy(update={"simulation": simulation})


def on_date(bench: BenchFile, start: datetime | None) -> BenchFile:
    """Return a simulated bench as it is on the day of an instant, None for the usual one: the same units, other noise.

    The same day is the same noise.
    """
    if start is None:
        return bench
    simulation = bench.simulation or SimulationSettings()
    dated = simulation.model_copy(update={"noise_seed": simulation.noise_seed + start.date().toordinal()})
    return bench.model_copy(update={"simulation": dated})


def clock_for(bench: BenchFile, speed: float | None, start: datetime | None = None) -> Clock:
    """Return the system's clock for real instruments; for simulated ones a paced clock, without a speed at no pace.

    Simulators in another process set the pace themselves. `start` is the aware instant at which simulated time begins.
    Raises BadInput for a speed or a start on a bench that has its own.
    """
    if not bench.is_simulated:
        if start is not None:
            raise BadInput(
                f"--simulated-start {start.isoformat()}: bench {bench.name} has instruments outside this process, "
                "which have the time of this computer; leave the option out"
            )
        if speed is not None:
            raise BadInput(f"--speed {speed:g}: bench {bench.name} runs in real time; leave the option out")
        return clock_outside(bench)
    return PacedClock(start=start or VIRTUAL_START) if speed is None else PacedClock(speed, start=start)


def load_libraries() -> None:
    """Import what is otherwise imported at first use: once a bench is open, a campaign depends on no further file."""
    import numpy.fft  # noqa: PLC0415  numpy itself imports these two at first use,
    import numpy.ma  # noqa: F401, PLC0415  this one in np.median

    load_compressor()


def prepare(
    store: Store,
    recipe_source: str,
    bench_file: BenchFile,
    clock: Clock,
    *,
    clip: bool,
    fit: bool = True,
    opened: Bench | None = None,
    bench_clear: str = "",
    wire: Wire | None = None,
) -> Prepared:
    """Open the bench, plan, and write the whole campaign down; the table is at rest when this returns.

    Without `fit` it ends in its recordings. `opened` is the bench where it is open already; `bench_clear` is what a
    person has confirmed about it; `wire` records it, or answers in its place. Raises InstrumentError, PlanRefused when
    the bench cannot do the recipe, Conflict for another unit or USB adapter than before and for a bad standard.
    """
    load_libraries()
    bench_file = with_drivers(bench_file)  # what is written down names the release of each driver
    recipe = _runnable(load_recipe(recipe_source), fit=fit)
    refuse_unconfirmed(store, bench_file.name)
    today = clock.utc().date()
    refuse_bad(store, standards_of(bench_file), today, bench_file.name)
    bench = opened or open_bench(bench_file, clock, wire=wire)
    try:
        with registered(clock):
            identities = _identities(bench, clock)
        plan = make_plan(recipe, _limits(bench, bench_file, times_on_bench(store, bench_file)), clip=clip)
        bench_file = _with_reported(store, bench_file, identities)
        units = _units(bench, identities, bench_file, clock, recipe, as_used(store, standards_of(bench_file), today))
        check_stop(plan, [RecordingInfo.model_validate(unit.info) for unit in units])
        new = NewCampaign(
            recipe_name=recipe.name,
            recipe=plan.recipe.model_dump(mode="json"),
            bench_name=bench_file.name,
            bench=bench_file.model_dump(mode="json"),
            schedule_hash=plan.schedule_hash,
            expected_s=plan.expected_s,
            steps=[step_json(step) for step in plan.steps],
            units=units,
            boot_id=boot_id(),
            bench_clear=bench_clear,
        )
        number = store.campaigns.create(new, clock.utc())
        _log_planned(number, bench_file, plan, units)
        return Prepared(number, plan, bench, clock, operator_of(bench))
    except BaseException:
        bench.close()
        raise


def _limits(bench: Bench, file: BenchFile, earlier: EarlierTimes | None = None) -> BenchLimits:
    return BenchLimits.of(
        bench, needs_person=file.needs_person, air_tau_s=file.air_tau_s, earlier=earlier,
        tilted_positions=file.tilted_positions, eccentricity=file.eccentricity,
    )  # fmt: skip


def _log_planned(number: int, bench: BenchFile, plan: Plan, units: tuple[NewUnit, ...]) -> None:
    log.info(
        "campaign.planned", campaign=number, bench=bench.name, recipe=plan.recipe.name, steps=len(plan.steps),
        datasets=plan.datasets, expected_s=round(plan.expected_s), simulated=bench.is_simulated,
        units=[unit.info["serial"] for unit in units], by=actor().name,
    )  # fmt: skip


def _with_reported(store: Store, bench: BenchFile, identities: Mapping[str, GyroIdentity]) -> BenchFile:
    """Return a bench with what its instruments say of themselves; raises Conflict where one is not the known one."""
    reported = reported_of(bench, {name: identity.reported for name, identity in identities.items()})
    refuse_otherwise_set(bench, reported)
    refuse_changed(store, bench, reported)
    return bench.model_copy(update={"reported": reported})


def _identities(bench: Bench, clock: Clock) -> dict[str, GyroIdentity]:
    """Return what each unit is, once the bench is known to be at rest; raises InstrumentError."""
    _identify_at_rest(bench, clock)
    return {name: gyro.identify() for name, gyro in bench.gyros.items()}


def _identify_at_rest(bench: Bench, clock: Clock) -> None:
    """Make sure that the right table and chamber answer, as far as the bench has them, and that the table is at rest.

    It may move where the process that drove it was killed. Raises InstrumentError.
    """
    table, chamber = bench.table, bench.chamber
    if table is not None:
        table.identify()
    if chamber is not None:
        chamber.identify()
    for reference in bench.references.values():
        reference.identify()
    _power_units(bench, clock)
    if table is not None and table.is_moving() and (complaint := stop_table(table, clock)):
        raise InstrumentError(table.name, complaint)


def _power_units(bench: Bench, clock: Clock) -> None:
    """Switch the supply of the units on at its nominal voltage, where it is off: they are to say what they are.

    Raises InstrumentError.
    """
    supply = bench.supply
    if supply is None:
        return
    supply.identify()
    if not supply.is_on():
        supply.set_voltage_v(supply.limits.nominal_v)
        clock.sleep(START_UP_S)


def _units(
    bench: Bench,
    identities: dict[str, GyroIdentity],
    bench_file: BenchFile,
    clock: Clock,
    recipe: Recipe,
    standards: tuple[Standard, ...],
) -> tuple[NewUnit, ...]:
    """Return the recording of each unit; raises BadInput for a column that would have two sources."""
    beside = reference_channels(bench, bench_file)
    return tuple(
        _unit(gyro, identities[name], bench.table, bench_file, clock, recipe, beside, standards)
        for name, gyro in bench.gyros.items()
    )


def _conventions(identity: GyroIdentity, bench: BenchFile) -> dict[str, str]:
    """Return the conventions that the bench file states for the figures of a unit's data sheet."""
    stated = next((unit.datasheet_conventions for unit in bench.gyros if unit.serial == identity.serial), {})
    return {name: convention for name, convention in stated.items() if name in identity.datasheet}


def _unit(
    gyro: Gyro,
    identity: GyroIdentity,
    table: RateTable | None,
    bench: BenchFile,
    clock: Clock,
    recipe: Recipe,
    beside: tuple[RawChannelJson, ...],
    standards: tuple[Standard, ...],
) -> NewUnit:
    latitude = bench.latitude_deg
    info = RecordingInfo.model_validate(
        {
            "serial": identity.serial,
            "model": identity.model,
            "axes": gyro.axes,
            "kind": "samples",
            "motion": recipe.motion,
            "rate_reference": None if table is None or recipe.turns is not None else table.limits.reference,
            "turn_common_u": None if recipe.turns is None else recipe.turns.common_u,
            "started_at": clock.utc(),
            "latitude_deg": latitude,
            "notes": reference_notes(bench),
            "sample_rate_hz": gyro.sample_rate_hz,
            "max_rate_dps": gyro.limits.max_rate_dps,
            "technology": identity.technology or None,
            "datasheet": dict(identity.datasheet),
            "datasheet_conventions": _conventions(identity, bench),
            "output": {axis: dict(output_unit) for axis, output_unit in identity.output.items()},
            "standards": standards,
            "thermometer": temperature_instrument(bench),
            "configuration": configuration_of(identity.reported),
        }
    )
    channels = tuple(raw_channel(channel) for channel in gyro.channels)
    refuse_doubled_columns(gyro.name, channels, beside)
    return NewUnit(gyro.name, info.model_dump(mode="json"), (*channels, *beside))
