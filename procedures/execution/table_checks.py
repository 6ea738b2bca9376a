"""What a table without an encoder finds out about its own steps: the step clock by timed runs, and missed steps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from instruments.interfaces.table import COVERAGE, HomeCheck, OpenLoopTable
from procedures.contracts.errors import StepFailed, TableStopped
from procedures.contracts.journal import ClockRun, DataSetState, Event
from procedures.contracts.steps import CheckHome, MeasureClock
from procedures.execution.context import ExecutionContext
from procedures.execution.waiting import pass_time
from procedures.monitoring import step_clock
from procedures.monitoring.event_recorder import warning
from procedures.monitoring.host_stalls import not_run
from procedures.monitoring.step_clock import LARGEST_CHANGE_PPM, MeasuredClock
from procedures.planning.clock_runs import FIRST_RUNS, drawn_lengths_s, run_lengths_s

#: So many runs are added where those that were planned disagree, and a run is repeated where this computer stalled.
MAX_ADDED, STALLED_ATTEMPTS = 8, 5
#: A lateness of this computer that a check for missed steps counts, s of real time.
MIN_LATE_S = 0.01
QUIETEN = "end other work on this computer, and set the latency of the table's USB adapter to 1 ms"


def measure_clock(context: ExecutionContext, step: MeasureClock) -> dict[str, float]:
    """Time runs of the table; every later rate is by the step clock that all runs of the campaign give.

    Raises StepFailed for runs that disagree before the first data set, InstrumentError.
    """
    table = context.bench.table
    if not isinstance(table, OpenLoopTable):
        return {}
    first = not any(run.session == context.clock_session for run in context.clock_runs)
    block = 1 + max((run.block for run in context.clock_runs), default=0)
    planned_s = step.runs_s or run_lengths_s(FIRST_RUNS, 0, step.short_s, table.limits.clock_run_s)
    rng = _length_generator(context, block)
    for steady_s in drawn_lengths_s(planned_s, rng):
        _add_run(context, table, step.rate_dps, steady_s, block)
    clock_result = step_clock.measured(context.clock_runs, table.step_clock)
    for n in range(MAX_ADDED):
        if clock_result is not None and clock_result.expanded_ppm <= table.limits.clock_limit_ppm:
            break
        (steady_s,) = drawn_lengths_s([planned_s[n % len(planned_s)]], rng)
        _add_run(context, table, step.rate_dps, steady_s, block)
        clock_result = step_clock.measured(context.clock_runs, table.step_clock)
    if clock_result is None:
        raise StepFailed(f"the step clock is not known: {len(context.clock_runs)} runs are too few; plan more of them")
    _require_agreement(context, clock_result, first=first)
    _use(context, clock_result)
    _say_clock(context, clock_result)
    return _figures(clock_result)


def _length_generator(context: ExecutionContext, block: int) -> np.random.Generator:
    """Return the generator of the lengths of a block's runs: another one for each recipe, session, block and day.

    A session that is replayed from its wire log, on the clock of the log, draws the same.
    """
    return np.random.default_rng((context.recipe.seed, context.clock_session, block, context.clock.utc().toordinal()))


def _use(context: ExecutionContext, measured_clock: MeasuredClock) -> None:
    """Compute every rate by the measured step clock, also those of the data sets so far."""
    before = step_clock.fitted([run for run in context.clock_runs if run.used])

    def factor(t_s: float) -> float:
        return 1.0 if before is None else measured_clock.fit.ratio(t_s) / before.ratio(t_s)

    context.recorder.journal.step_clock(measured_clock.u_ppm, measured_clock.fit.freedom, factor)
    context.clock_runs = [replace(run, used=True) for run in context.clock_runs]
    follow_clock(context)


def follow_clock(context: ExecutionContext) -> None:
    """Make the table compute its rates by its step clock as it is known now; before, they are by the nominal one."""
    table = context.bench.table
    fit = step_clock.fitted([run for run in context.clock_runs if run.used])
    if fit is not None and isinstance(table, OpenLoopTable):
        table.use_step_clock(fit.ratio(context.recorder.t_s()))


def _add_run(context: ExecutionContext, table: OpenLoopTable, rate_dps: float, steady_s: float, block: int) -> None:
    """Time one run, again where this computer did not run labctl meanwhile, and record it."""
    for attempt in range(STALLED_ATTEMPTS):
        stalled_s = context.monitor.stalls.total_s()
        run = table.time_run(rate_dps, steady_s, lambda wait_s: _watched_wait(context, wait_s))
        if not (stalled_s := context.monitor.stalls.total_s() - stalled_s) or attempt == STALLED_ATTEMPTS - 1:
            break
        text = f"a run that times the step clock is repeated: {not_run(stalled_s)} while it was made"
        context.recorder.event(warning("run_repeated", text))
    middle_s = float(context.recorder.time.of(run.began_s + 0.5 * run.duration_s))
    timed = ClockRun(context.clock_session, block, middle_s, run.nominal_s, run.duration_s, run.step_hz)
    context.clock_runs.append(timed)
    context.recorder.journal.timed_run(timed)


def _require_agreement(context: ExecutionContext, measured_clock: MeasuredClock, *, first: bool) -> None:
    """Raise StepFailed where runs disagree before data sets rely on them; say it where data sets exist already."""
    name, limit_ppm = context.bench.table.name, context.bench.table.limits.clock_limit_ppm
    change = step_clock.change_ppm(context.clock_runs, context.clock_session) if first else None
    if change is not None and abs(change[0]) > change[1] + LARGEST_CHANGE_PPM:
        raise StepFailed(
            f"{name}: the step clock has changed by {change[0]:+.0f} ppm since the campaign was interrupted, limit "
            f"{change[1] + LARGEST_CHANGE_PPM:.0f} ppm: {QUIETEN} and resume the campaign, or start a new one where "
            "the controller or its settings were changed"
        )
    if measured_clock.expanded_ppm <= limit_ppm:
        return
    text = (
        f"{name}: the runs that time the step clock disagree: U = {measured_clock.expanded_ppm:.0f} ppm (95 %) by the "
        "scatter "
        f"of {measured_clock.runs} runs, {1e3 * measured_clock.fit.scatter_s:.1f} ms, limit {limit_ppm:g} ppm; "
        f"{QUIETEN}, or make the "
        "runs longer by clock_run_s in the bench file"
    )
    if first:
        raise StepFailed(text)
    context.recorder.event(
        Event(
            "table_clock",
            text,
            level="warning",
            device=name,
            value=measured_clock.expanded_ppm,
            limit=limit_ppm,
            unit="ppm",
        )
    )


def _say_clock(context: ExecutionContext, measured_clock: MeasuredClock) -> None:
    name, beyond = context.bench.table.name, abs(measured_clock.deviation_ppm) > measured_clock.limit_ppm
    text = (
        f"{name}: the step rate is {measured_clock.deviation_ppm:+.0f} ppm off step_clock_hz = "
        f"{measured_clock.nominal.nominal_hz:g} Hz, "
        f"u = {measured_clock.u_ppm:.1f} ppm with {measured_clock.fit.freedom} degrees of freedom by the scatter of "
        f"{measured_clock.runs} runs "
        f"({1e3 * measured_clock.fit.scatter_s:.1f} ms), limit {measured_clock.limit_ppm:.0f} ppm; rates are by the "
        "measured clock"
    )
    drift = f"{measured_clock.fit.drift_ppm_per_h:+.1f} ppm/h, u = {measured_clock.fit.drift_u_ppm_per_h:.1f} ppm/h"
    if measured_clock.fit.is_drift_applied:
        text += f"; it drifts by {drift}"
    elif measured_clock.fit.has_drift:
        text += f"; a drift of {drift}, is not significant: it is not applied, and u contains it"
    if beyond:
        text += (
            f": set step_clock_hz = {measured_clock.nominal.nominal_hz * measured_clock.ratio:.0f} in the bench file"
        )
    level = "warning" if beyond else "info"
    context.recorder.event(
        Event(
            "table_clock",
            text,
            level,
            name,
            value=measured_clock.deviation_ppm,
            limit=measured_clock.limit_ppm,
            unit="ppm",
        )
    )


def _figures(measured_clock: MeasuredClock) -> dict[str, float]:
    return {
        "step_clock_ratio": measured_clock.ratio,
        "step_clock_hz": measured_clock.nominal.nominal_hz * measured_clock.ratio,
        "deviation_ppm": measured_clock.deviation_ppm,
        "u_ppm": measured_clock.u_ppm,
        "freedom": float(measured_clock.fit.freedom),
        "expanded_ppm": measured_clock.expanded_ppm,
        "deviation_expanded_ppm": measured_clock.deviation_expanded_ppm,
        "limit_ppm": measured_clock.limit_ppm,
        "drift_ppm_per_h": measured_clock.fit.drift_ppm_per_h,
        "drift_u_ppm_per_h": measured_clock.fit.drift_u_ppm_per_h,
        "scatter_s": measured_clock.fit.scatter_s,
        "runs": float(measured_clock.runs),
    }


def check_home(context: ExecutionContext, step: CheckHome) -> dict[str, float]:
    """Check for missed steps. Those that are found end the campaign, and the data sets since the last check with it.

    Raises TableStopped, InstrumentError.
    """
    table = context.bench.table
    if not isinstance(table, OpenLoopTable):
        return {}
    check, late_s = _timed_check(context, table)
    if check is not None and check.learning and late_s:
        context.recorder.event(warning("home_unchecked", f"home is checked again: {_late_text(late_s)}"))
        check, late_s = _timed_check(context, table)
    since, context.unchecked = context.unchecked, []
    if check is None:
        return {}
    late_steps = context.monitor.stalls.speed * late_s / check.step_s
    if check.is_missing and (check.is_shown or late_steps < check.missed_steps - check.limit_steps):
        reason = _missing_text(table.name, check, step.temperature_c)
        for number in since:
            context.recorder.journal.dataset_closed(number, DataSetState.PARTIAL, reason)
        raise TableStopped(reason, {"missed_steps": check.missed_steps, "u_steps": check.u_steps})
    if check.u_steps > check.limit_steps:
        text = (
            f"{table.name}: the check for missed steps is blind below {COVERAGE * check.u_steps:.0f} steps, limit "
            f"{check.limit_steps:g} steps, because homings from one place scatter (u = {check.u_steps:.1f} steps)"
        )
        context.recorder.event(warning("home_uncertain", f"{text}; {QUIETEN}", table.name))
    if check.explained:
        context.recorder.event(warning("home_doubtful", f"{table.name}: {check.explained}; {QUIETEN}", table.name))
    elif check.is_doubtful or check.is_missing:
        text = (
            f"{table.name}: home seems {check.missed_steps:g} steps from where it was left, limit "
            f"{check.limit_steps:g} steps, but a late reply explains it (u = {check.u_steps:.1f} steps"
        )
        text += f", {_late_text(late_s)})" if late_s else ")"
        context.recorder.event(warning("home_doubtful", f"{text}; {QUIETEN}", table.name))
    return {
        "missed_steps": check.missed_steps,
        "u_steps": check.u_steps,
        "limit_steps": check.limit_steps,
    }


def _timed_check(context: ExecutionContext, table: OpenLoopTable) -> tuple[HomeCheck | None, float]:
    """Return the check for missed steps, and by how much this computer may have timed its replies late, real s.

    0 for less than `MIN_LATE_S`: the uncertainty of a reply contains that.
    """
    stalls = context.monitor.stalls
    stalled_s = stalls.total_s()
    with stalls.lateness() as lateness:
        check = table.check_home(lambda wait_s: _watched_wait(context, wait_s))
    late_s = max(stalls.total_s() - stalled_s, lateness.largest_s)
    return check, late_s if late_s >= MIN_LATE_S else 0.0


def _late_text(late_s: float) -> str:
    return f"this computer ran labctl late by up to {late_s:.2f} s meanwhile"


def _missing_text(name: str, home_check: HomeCheck, temperature_c: float) -> str:
    turn_steps = 360.0 / home_check.step_deg  # a table that stands beyond home homes by nearly a whole turn
    missed_steps = math.remainder(home_check.missed_steps, turn_steps)
    size = f"{missed_steps:g} steps ({missed_steps * home_check.step_deg:.3g} deg)"
    where = (
        f"about {size} were missed in the short turns from which the homing is learned"
        if home_check.learning
        else f"home is {size} from where it was left"
    )
    return (
        f"{name}: {where}, u = {home_check.u_steps:.1f} steps, limit {home_check.limit_steps:g} steps, "
        f"at {temperature_c:g} deg C; steps were missed: check load, acceleration_dps2 and supply of the motor"
    )


def _watched_wait(context: ExecutionContext, wait_s: float) -> None:
    """Wait while requests are obeyed and the bench is watched."""
    until_s = context.clock.now_s() + wait_s
    while (left_s := until_s - context.clock.now_s()) > 0:
        if context.monitor.is_due():
            context.poll()
        pass_time(context, min(left_s, 1.0), pausing=False)
