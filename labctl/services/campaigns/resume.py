"""Resuming an interrupted campaign: by itself after a crash or a power cut, by a person's word after a fault."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from pydantic import ValidationError

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import Clock, SystemClock
from instruments.transport.factory import Wire
from labctl.answers.campaigns import CampaignResponse, ResumeRequest
from labctl.answers.wire_logs import RecordedSession
from labctl.config import default_database
from labctl.errors import Conflict
from labctl.log import get_logger
from labctl.natural_order import natural_key
from labctl.services.benches.confirmation import SafeStateRetry
from labctl.services.benches.driving_process import whereabouts
from labctl.services.benches.identity import pinned, reported_in
from labctl.services.benches.lease import holding, open_for
from labctl.services.benches.power_failure import boot_id, power_failed
from labctl.services.benches.wire_log import recording
from labctl.services.campaigns.execution import Attend, Observe, run_attended
from labctl.services.campaigns.preparation import (
    Prepared,
    clock_for,
    load_libraries,
    operator_of,
    refuse_unconfirmed,
)
from labctl.services.campaigns.readings_digest import readings_digest
from labctl.services.campaigns.stop_socket import let_move
from labctl.services.planning.loading import load_bench, with_drivers
from labctl.store import CampaignRow, ResumePoint, Resumption, Store, open_store
from procedures.contracts.campaign_state import CampaignState
from procedures.execution.resume import Restart
from procedures.execution.stoppable_clock import stoppable
from procedures.monitoring.campaign_time import CampaignTime
from procedures.planning.plan import Plan
from procedures.recipe.recipe import Recipe

log = get_logger()


def plan_of(store: Store, row: CampaignRow) -> Plan:
    """Return the plan of a campaign as it was written down."""
    return Plan.model_validate(
        {
            "recipe": Recipe.model_validate(dict(row.recipe)),
            "steps": [step.body for step in store.campaigns.steps(row.id)],
        }
    )


def with_original_simulation(row: CampaignRow, bench_file: BenchFile) -> BenchFile:
    """Return a simulated bench with the simulation that a campaign was begun in: the same units, on the same day.

    A real bench is returned unchanged. Raises Conflict for a simulation whose settings this version does not know.
    """
    was = row.bench.get("simulation")
    if not bench_file.is_simulated or was is None:
        return bench_file
    try:
        return bench_file.model_copy(update={"simulation": SimulationSettings.model_validate(was)})
    except ValidationError as error:
        first = error.errors()[0]
        raise Conflict(
            f"campaign {row.id} was simulated by another version of labctl, whose settings are not valid here: "
            f"simulation.{'.'.join(map(str, first['loc']))}: {first['msg']}; abort the campaign, and start a new one"
        ) from error


def prepare_resume(
    store: Store,
    campaign: int,
    bench_file: BenchFile,
    make_clock: Callable[[ResumePoint], Clock],
    request: ResumeRequest,
    opened: Bench | None = None,
    wire: Wire | None = None,
) -> Prepared:
    """Mark a campaign as resumed, and return it ready to run; nothing has moved when this returns.

    `opened` is the bench where it is open already; `wire` records it. Raises Conflict when the campaign is done, when
    the bench carries other units, or when it waits to be inspected.
    """
    load_libraries()
    row = store.campaigns.get(campaign)
    if row.state is CampaignState.DONE:
        raise Conflict(f"campaign {campaign} is done and cannot be resumed; start a new one")
    refuse_other_bench(store, row, bench_file.name)
    bench_file = _same_units(row, bench_file)
    refuse_unconfirmed(store, bench_file.name)
    standing, plan = store.resume_points.of_campaign(campaign), plan_of(store, row)
    clock = make_clock(standing)
    new_world = bench_file.is_simulated and opened is None  # a simulated bench ends with its process
    lost = request.power == "lost" or (
        request.power is None and (new_world or power_failed(standing.boot_id, boot_id()))
    )
    lost = lost or (bench_file.supply is not None and bench_file.supply.safe_state == "off")
    new_session = lost and plan.run_at(standing.start_at, standing.skipped) > 0
    t_s = max(standing.last_t_s, (clock.utc() - row.started_at).total_seconds() if row.started_at else 0.0)
    gap_s = t_s - standing.last_t_s
    added = standing.added_runs + int(new_session)
    power = "the power failed during the interruption" if lost else "the units stayed on"
    changed = _other_drivers(row, bench_file)
    reason = f"resumed by {request.by} after {gap_s:.0f} s without supervision; {power}{changed}"
    bench = opened or open_bench(bench_file, clock, wire=wire)
    try:
        _mark_resumed(store, row, standing, Resumption(t_s, clock.utc(), reason, added, new_session, boot_id()))
        if new_world and (position := plan.mounted_at(standing.start_at)):
            bench.unit_handler.mount(position)
    except BaseException:
        bench.close()
        raise
    restart = Restart(
        gap_s=float("inf") if standing.soak_owed else gap_s, power_lost=lost, added_runs=added,
        dropped=standing.dropped, skipped=standing.skipped, clock_runs=standing.clock_runs,
    )  # fmt: skip
    return Prepared(
        campaign, plan, bench, clock, operator_of(bench), standing.start_at, restart, CampaignTime(clock, t_s)
    )


def refuse_other_bench(store: Store, row: CampaignRow, bench: str) -> None:
    """Raise Conflict for another bench than the campaign's where that bench may have a service of its own.

    Its service resumes what is unfinished on its bench, and could not know that the campaign runs on another one.
    """
    if store.is_shared and bench != row.bench_name:
        advice = whereabouts(store, row.bench_name)
        raise Conflict(
            f"campaign {row.id} was begun on bench {row.bench_name}, not {bench}, and several services write to this "
            f"database: the campaign is resumed on its own bench only; {advice}"
        )


def _mark_resumed(store: Store, row: CampaignRow, standing: ResumePoint, how: Resumption) -> None:
    store.resume_points.mark_resumed(row.id, standing, how)
    log.info(
        "campaign.resumed", campaign=row.id, bench=row.bench_name, step=standing.start_at + 1, reason=how.reason,
        was=row.state, units=sorted(row.recordings, key=natural_key),
    )  # fmt: skip


def _other_drivers(row: CampaignRow, bench_file: BenchFile) -> str:
    """Return which instruments have another driver, or another release of it, than when the campaign began."""
    was = row.bench_file.drivers
    changed = [
        f"; driver of {device}: {now.driver} of {now.distribution} {now.version} instead of "
        f"{then.driver} of {then.distribution} {then.version}"
        for device, now in bench_file.drivers.items()
        if (then := was.get(device)) is not None and then != now
    ]
    return "".join(changed)


def _same_units(row: CampaignRow, bench_file: BenchFile) -> BenchFile:
    """Return the bench with its drivers, which accepts only the instruments that the campaign began with.

    Raises Conflict where it carries other units, BadBench for a driver.
    """
    measured, carried = (
        sorted(serials, key=natural_key) for serials in (row.recordings, {gyro.serial for gyro in bench_file.gyros})
    )
    if measured != carried:
        raise Conflict(
            f"campaign {row.id} measures the units {', '.join(measured)}, but bench "
            f"{bench_file.name} has the units {', '.join(carried)}; name the bench of the campaign with --bench"
        )
    return pinned(with_drivers(bench_file), reported_in(row))


def resume_here(
    database: str | None,
    campaign: int | None,
    bench: str | None,
    speed: float | None,
    request: ResumeRequest,
    observe: Observe | None = None,
    attend: Attend | None = None,
    wire_log: Path | None = None,
) -> CampaignResponse:
    """Resume a campaign in this process and run it to its end; without a number the newest that is not over.

    `wire_log` is the file that gets every byte between labctl and the bench.
    """
    location = database or default_database()
    with open_store(location, write=False) as store:
        row = store.campaigns.get(campaign) if campaign is not None else _newest_unfinished(store)
    bench_file = load_bench(bench) if bench else BenchFile.model_validate(dict(row.bench))
    with open_for(bench_file, location) as store, holding(store, bench_file) as control:

        def make_clock(standing: ResumePoint) -> Clock:
            clock = clock_for(bench_file, speed, _simulated_start(bench_file, speed, standing.last_at))
            return stoppable(clock, control)

        SafeStateRetry(store, bench_file, lambda: clock_for(bench_file, speed)).attempt()
        let_move(store, bench_file.name, request.by, SystemClock().utc())
        clock = make_clock(store.resume_points.of_campaign(row.id))
        with recording(
            wire_log, bench_file, clock, RecordedSession(kind="campaign resume", campaign=row.id)
        ) as recorded:
            wire = None if recorded is None else recorded.wire
            prepared = prepare_resume(store, row.id, bench_file, lambda _: clock, request, wire=wire)
            answer = run_attended(store, prepared, control, observe, attend, wire)
            if recorded is not None:
                recorded.result.state = answer.state.value
                recorded.result.readings = readings_digest(store, answer.id)
            return answer


def _simulated_start(bench_file: BenchFile, speed: float | None, last_at: datetime) -> datetime | None:
    """Return where simulated time goes on; None for real instruments, and where it goes on at the present time."""
    if not bench_file.is_simulated:
        return None
    return last_at if speed is None or last_at > SystemClock().utc() else None


def _newest_unfinished(store: Store) -> CampaignRow:
    rows = store.campaigns.unfinished()
    if not rows:
        raise Conflict(
            "no campaign was interrupted; `labctl campaign resume ID` resumes one that failed or was aborted"
        )
    return rows[0]
