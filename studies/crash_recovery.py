"""A campaign killed at every kind of instant, by a dying process or a power cut: what the next process makes of it."""

from __future__ import annotations

import os
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import BenchFile
from labctl.answers.campaigns import ResumeRequest
from labctl.services.campaigns import execution
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from studies.crashable_process import Killed, Life, MortalDatabase, World, all_readings, complete_data_sets
from studies.databases import close_server, new_database

KILLS = int(os.environ.get("LABCTL_STUDY_KILLS", "240"))
SEED = 20
#: How often it is said how far the study is: one that is interrupted has judged what it says.
SHOWN_EACH = 20
#: Every kind of step: two mountings, two powered sessions and a power cycle, in under two hours of bench time.
RECIPE = """
format = "labctl-recipe/1"
name = "mortal"
temperatures_c = [24, 26, 28]
rates_dps = [-40, 40]
positions = ["z", "-z"]
warm_up_s = 30
[mounting]
repower_each = true
[soak]
hold_s = 900
max_drift_c = 0.5
drift_window_s = 60
timeout_s = 3600
[acquire]
duration_s = 10
settle_s = 2
[power_cycle]
off_s = 60
rates_dps = [0, 40]
"""
DATA_SETS = 14
#: A data set scatters by 0.0014 deg/s/rtHz over 10 s and 0.0011 deg/s of drift.
NOISE_DPS = 0.0012
#: Two fits agree where they differ by less than so many standard uncertainties of the difference; the unit's law is
#: nonlinear, so their errors at one point are compared.
MAX_U = 5.0
REFERENCE_C = 26.5

#: Bias and error of scale at 40 deg/s, then the standard uncertainty of both, (2, 2) deg/s.
Fitted = NDArray[np.float64]


@dataclass(frozen=True)
class Kill:
    """When a campaign is ended, by what, and for how long no process runs."""

    at: int
    power_cut: bool
    gap_s: float
    seed: int


@dataclass(frozen=True)
class Verdict:
    """What became of a campaign that was killed once, or twice."""

    state: str
    steps_open: int
    missing_readings: int
    wrong_counts: int  #: data sets of the plan that are there twice, or not at all
    within_limits: bool
    safe: bool
    worst_u: float  #: largest difference of the fit from the undisturbed campaign's, in standard uncertainties
    new_session: bool

    @property
    def well(self) -> bool:
        """Whether all that was promised holds."""
        clean = self.state == "done" and not (self.steps_open or self.missing_readings or self.wrong_counts)
        return clean and self.within_limits and self.safe and self.worst_u < MAX_U


def bench() -> BenchFile:
    """Return the bench that outlives the processes.

    Two things are left out that change with the instant of a data set and are no noise of the fit: the unit does not
    heat itself (after minutes without power it would be colder), and the motor's steps are even (where in a step a gate
    begins is worth up to 4 mdeg/s over 10 s).
    """
    single = load_bench("single-axis-sim")
    assert single.simulation is not None
    units = {"fog": {"self_heating_c": 0.0}}
    return single.model_copy(
        update={"simulation": single.simulation.model_copy(update={"units": units, "table": {"step_error_deg": 0.0}})}
    )


def first_process(world: World, location: str, life: Life) -> tuple[MortalDatabase, int | None]:
    """Begin a campaign and run it until it is over or killed; returns the database, still open, and the campaign."""
    database = MortalDatabase(location, life)
    world.clock.life = life
    campaign = None
    store = Store(database)
    try:
        prepared = prepare(store, RECIPE, world.bench_file, world.clock, clip=False, opened=world.open())
        campaign = prepared.id
        execution.run(store, prepared)
    except Killed:
        pass
    return database, campaign


def undisturbed(folder: Path) -> tuple[int, Fitted]:
    """Return how many instants the campaign has, and what is fitted to it."""
    life = Life()
    database, campaign = first_process(World(bench()), new_database(folder), life)
    assert campaign is not None
    store = Store(database)
    found = fitted(store, campaign)
    store.close()
    return life.ticks, found


def fitted(store: Store, campaign: int) -> Fitted:
    """Return bias and error of scale at 40 deg/s, both at the reference temperature, and their uncertainties.

    The soaks are long enough that the unit settles in them: else it is warmer after a time without a process, and its
    temperature lags less behind the chamber's.
    """
    points = store.recordings.points(store.campaigns.get(campaign).recordings["FOG-0001"]).columns
    up = np.where(np.asarray(points["position"]) == "z", 1.0, -1.0)
    rate = up * np.asarray(points["table_rate_dps"])
    warm = np.asarray(points["temperature_c"]) - REFERENCE_C
    terms = np.stack([np.ones_like(rate), rate / 40.0, warm, warm * rate / 40.0, warm**2, up], axis=1)
    values = np.linalg.lstsq(terms, np.asarray(points["gyro_z"]) - rate, rcond=None)[0]
    u_dps = NOISE_DPS * np.sqrt(np.diag(np.linalg.inv(terms.T @ terms)))
    return np.stack([values[:2], u_dps[:2]])


def difference_u(one: Fitted, other: Fitted) -> float:
    """Return the largest difference of two fits, in standard uncertainties of the difference."""
    return float(np.max(np.abs(one[0] - other[0]) / np.hypot(one[1], other[1])))


def judge(kill: Kill, expected: Fitted, folder: Path) -> Verdict:
    """Kill one campaign, let the next process resume it, and compare the result with what is promised."""
    world, rng = World(bench()), np.random.default_rng(kill.seed)
    life = Life(kill.at)
    database, campaign = first_process(world, new_database(folder / "first"), life)
    world.pass_gap(kill.gap_s, power_cut=kill.power_cut)
    location = database.abandoned_campaigns(folder / "next", power_cut=kill.power_cut, rng=rng)
    database.close()
    database = MortalDatabase(location, world.clock.life)
    store = Store(database)
    left = store.campaigns.unfinished()
    if not left:  # killed before the campaign was written down, or after its end was: nothing is to be resumed
        done = store.campaigns.all()
        if campaign is None or not done:
            store.close()
            return Verdict("done", 0, 0, 0, world.within_limits, True, 0.0, False)
        return _verdict(database, world, done[0].id, set(), expected)
    before = all_readings(database)
    request = ResumeRequest(by="the next process", power="lost" if kill.power_cut else "kept")
    opened = world.open()
    execution.run(store, prepare_resume(store, left[0].id, world.bench_file, lambda _: world.clock, request, opened))
    return _verdict(database, world, left[0].id, before, expected)


def _verdict(
    database: MortalDatabase,
    world: World,
    campaign: int,
    before: set[tuple[int, int, int]],
    expected: Fitted,
) -> Verdict:
    store, planned = Store(database), set(range(1, DATA_SETS + 1))
    complete = complete_data_sets(database)
    row, steps = store.campaigns.get(campaign), store.campaigns.steps(campaign)
    wrong = sum(complete[number] != 1 for number in planned) + len(set(complete) - planned)
    verdict = Verdict(
        row.state,
        sum(step.state != "done" for step in steps),
        len(before - all_readings(database)),
        wrong,
        world.within_limits,
        _safe(world),
        difference_u(fitted(store, campaign), expected) if row.state == "done" else np.inf,
        store.resume_points.of_campaign(campaign).added_runs > 0,
    )
    store.close()
    return verdict


def _safe(world: World) -> bool:
    opened = world.open()
    safe_c = world.bench_file.chamber.safe_c
    safe = not opened.table.is_moving() and abs(opened.chamber.read().setpoint_c - safe_c) < 0.1
    opened.close()
    return safe


def drawn(instants: int, count: int, seed: int = SEED) -> list[Kill]:
    """Return kills spread evenly over a campaign's instants, each at a point of its own drawn at random."""
    rng = np.random.default_rng(seed)
    edges = np.linspace(1, instants, count + 1)
    return [
        Kill(int(rng.integers(int(low), max(int(high), int(low) + 1))), bool(index % 2), gap_s, index)
        for index, (low, high) in enumerate(pairwise(edges))
        for gap_s in [float(rng.choice([1.0, 20.0, 600.0]))]
    ]


def one(task: tuple[Kill, Fitted]) -> Verdict:
    """Judge one kill in a folder of its own."""
    kill, expected = task
    with tempfile.TemporaryDirectory() as folder:
        return judge(kill, expected, Path(folder))


def run_kills(count: int) -> dict[str, float]:
    """Kill campaigns, and return the figures."""
    with tempfile.TemporaryDirectory() as folder:
        instants, expected = undisturbed(Path(folder))
    close_server()  # the workers would share it, and a power cut in one of them would be a power cut in all
    kills = drawn(instants, count)
    with ProcessPoolExecutor(max_workers=2) as pool:
        verdicts = []
        for verdict in pool.map(one, [(kill, expected) for kill in kills], chunksize=4):
            verdicts.append(verdict)
            if not verdict.well or len(verdicts) % SHOWN_EACH == 0:
                well = sum(each.well for each in verdicts)
                print(f"   {well} of {len(verdicts)} as promised; the last: {verdict}", flush=True)
    return {
        "instants": float(instants),
        "kills": float(len(kills)),
        "power_cuts": float(sum(kill.power_cut for kill in kills)),
        "finished_as_promised": float(sum(verdict.well for verdict in verdicts)),
        "readings_missing": float(sum(verdict.missing_readings for verdict in verdicts)),
        "data_sets_twice_or_missing": float(sum(verdict.wrong_counts for verdict in verdicts)),
        "new_sessions": float(sum(verdict.new_session for verdict in verdicts)),
        "worst_difference_u": max(verdict.worst_u for verdict in verdicts),
    }


def run() -> dict[str, float]:
    """Return the figures of the whole study."""
    return run_kills(KILLS)
