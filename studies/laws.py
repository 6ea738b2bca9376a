"""Laws that labctl proposes for what no effect of the catalogue describes: are they the hidden ones, on other data?

Twenty laws that the catalogue has not (`studies.foreign_laws`) are added in turn to the outputs of simulated units, so
large that what the published model cannot absorb has chi2 = z^2 over all data sets, each at the noise floor of its
mean, for z = 10, 30, 100 and 300. A law of which less than 3 % is visible beside the model is left out. Every recording
is criticised, and laws are proposed whatever the verdict; in use they are proposed where the verdict is *unexplained*.

The error of a proposal is what it models minus the hidden law over the hidden law (root mean squares), each without the
part that the model absorbs: on the data sets that it is fitted to, and on another recording of the same unit on another
day, at other rates and temperatures inside the range. The data sets of the other recording are those at which no
channel is outside the range of the first. A proposal is good where both are at most 10 %. *Known form* is the same
error where the form of the law is known and only its size is fitted. *Worse* compares the root mean square of what is
left of the other recording with the law and without it.

In the last two schedules an experiment is measured as well, at rates half-way between those of the recipe (2.2 h), once
and five times, and all recordings are criticised together.

`LABCTL_STUDY_SEEDS` is how many units each law and size has, `LABCTL_STUDY_NULLS` how many recordings of each schedule
have nothing hidden, `LABCTL_STUDY_SEED` the first seed, `LABCTL_STUDY_WORKERS` the number of processes, and
`LABCTL_STUDY_SCHEDULES` the schedules, with semicolons between them. A case takes 2 to 30 s of one core.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import SimulationSettings
from labctl.errors import LabctlError
from labctl.fitting.criticism import Criticism, criticise, laws_of
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.models.presets import usual_model
from labctl.recording import Recording
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.experiments import BLOCKS
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe
from studies.foreign_laws import SHAPES, kind_of_law
from studies.law_witness import Witness, inside, without_absorbed
from studies.report_tables import markdown, share

Array = NDArray[np.float64]
SEEDS = int(os.environ.get("LABCTL_STUDY_SEEDS", "1"))
NULLS = int(os.environ.get("LABCTL_STUDY_NULLS", "20"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "4700"))
WORKERS = int(os.environ.get("LABCTL_STUDY_WORKERS", "2"))
ASKED = [name for name in os.environ.get("LABCTL_STUDY_SCHEDULES", "").split(";") if name]
Z_LEVELS = (10.0, 30.0, 100.0, 300.0)
READINGS_HZ = 4.0
#: A law of which less than this share is visible beside the model is not hidden.
MIN_VISIBLE = 0.03
#: Largest error of a good proposal, of the hidden law.
GOOD = 0.1
#: What is left of the other recording is clearly worse from this ratio on.
CLEARLY = 1.01


@dataclass(frozen=True)
class Schedule:
    """A shipped recipe with changes for what is criticised, and for the other recording."""

    recipe: str
    bench: str
    changes: Mapping[str, object]
    other: Mapping[str, object]
    then: str = ""  #: the experiment that is measured as well, and criticised together with the first
    times: int = 1  #: how often the experiment is measured

    @property
    def days(self) -> tuple[int, ...]:
        """The recordings that are criticised together."""
        return (0, *range(2, 2 + self.times)) if self.then else (0,)


def _both_ways(*rates_dps: float) -> tuple[float, ...]:
    return (0.0, *(sign * rate for rate in rates_dps for sign in (1.0, -1.0)))


SHUFFLED: Mapping[str, object] = {"temperature_order": "up_down", "rate_order": "random", "seed": 7}
BETWEEN: Mapping[str, object] = {
    "temperatures_c": (26.0, 29.0, 32.5, 36.0, 39.0, 42.0, 44.0), "rates_dps": _both_ways(12, 33, 50, 67, 90),
}  # fmt: skip
PUBLISHED: tuple[str, str, Mapping[str, object]] = ("ojeda2000-121", "single-axis-sim", {})
#: The first is as published; the tri-axial one is the quick look with more rates, in another order.
SCHEDULES: dict[str, Schedule] = {
    "single-axis": Schedule(*PUBLISHED, BETWEEN),
    "single-axis, re-ordered": Schedule("ojeda2000-121", "single-axis-sim", SHUFFLED, {**SHUFFLED, **BETWEEN}),
    "tri-axial": Schedule(
        "quick-triaxial", "triaxial-sim", {**SHUFFLED, "rates_dps": _both_ways(40, 100, 180, 280, 400)},
        {**SHUFFLED, "temperatures_c": (5.0, 12.0, 22.0, 38.0), "rates_dps": _both_ways(70, 140, 220, 340)},
    ),
    "single-axis, and between its rates": Schedule(*PUBLISHED, BETWEEN, "between_rates"),
    "single-axis, and five times between its rates": Schedule(*PUBLISHED, BETWEEN, "between_rates", times=5),
}  # fmt: skip


@lru_cache(maxsize=16)
def recorded(schedule: str, seed: int, day: int) -> Recording:
    """Return a recording of a unit with nothing hidden: day 0 the one that is criticised, day 1 the other.

    From day 2 on it is the experiment of the schedule.
    """
    chosen = SCHEDULES[schedule]
    recipe = load_recipe(chosen.recipe).model_copy(update=dict(chosen.other if day == 1 else chosen.changes))
    if day >= 2:
        changed = next(block for block in BLOCKS if block.id == chosen.then).changed(recipe)
        assert changed is not None
        recipe = changed
    return recorded_by(recipe, chosen.bench, seed, day)


def recorded_by(recipe: Recipe, bench_name: str, seed: int, day: int) -> Recording:
    """Return what a recipe measures of a unit with nothing hidden, with the noise of a day."""
    bench = load_bench(bench_name)
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": READINGS_HZ})
    settings = (bench.simulation or SimulationSettings()).model_copy(update={"noise_seed": day})
    plan = make_plan(recipe, limits_of(bench))
    return hidden_recording(plan, bench.model_copy(update={"simulation": settings}), gyro, seed, {})


@dataclass(frozen=True)
class Case:
    """One recording: on which schedule, of which unit, and what is hidden in it."""

    schedule: str
    seed: int
    law: str = ""  #: nothing where it is empty
    z: float = 0.0


@dataclass(frozen=True)
class Proposal:
    """One law as it is proposed: its words, its probability, its errors, and what is left over what was left."""

    formulas: tuple[str, ...]
    probability: float
    own: float  #: error over the hidden law, on the data sets that it was fitted to
    other: float  #: the same on the other recording
    left: float  #: RMS of what is left of the other recording, over that without the law

    @property
    def good(self) -> bool:
        """Whether it is the hidden law, to 10 %, on both recordings."""
        return max(self.own, self.other) <= GOOD


@dataclass(frozen=True)
class Outcome:
    """What was said about a case."""

    case: Case
    form: str
    named: tuple[str, ...] = ()
    follows: tuple[str, ...] = ()
    proposals: tuple[Proposal, ...] = ()
    known_form: float = np.inf
    failed: str = ""  #: why nothing could be said

    @property
    def best(self) -> Proposal | None:
        """The proposal that is nearest to what is hidden."""
        return min(self.proposals, key=lambda one: max(one.own, one.other), default=None)


@lru_cache(maxsize=64)
def unit_size(schedule: str, seed: int, law: str) -> tuple[float, float]:
    """Return z and the visible share of a law of unit size: over all data sets, in noise floors of their means."""
    plain = recorded(schedule, seed, 0)
    data, added = fit_data_of(plain), fit_data_of(kind_of_law(law, _fastest_dps(plain)).added(plain, seed, 1.0))
    model, visible, whole = usual_model(data), 0.0, 0.0
    for axis, noise in data.noise_floor.axes.items():
        hidden = added.outputs[axis] - data.outputs[axis]
        visible += float(np.sum((without_absorbed(model, data, axis)(hidden) / noise.floor_dps) ** 2))
        whole += float(np.sum((hidden / noise.floor_dps) ** 2))
    return float(np.sqrt(visible)), float(np.sqrt(visible / whole))


def _fastest_dps(recording: Recording) -> float:
    return float(np.abs(np.asarray(recording.columns["table_rate_dps"], dtype=np.float64)).max())


def with_law(case: Case, day: int) -> Recording:
    """Return a recording of a case's unit with its law: the size belongs to z on the recording that is criticised."""
    return with_law_in(recorded(case.schedule, case.seed, day), case)


def with_law_in(plain: Recording, case: Case) -> Recording:
    """Return any recording of a case's unit with its law."""
    if not case.law:
        return plain
    size_dps = case.z / unit_size(case.schedule, case.seed, case.law)[0]
    fastest_dps = _fastest_dps(recorded(case.schedule, case.seed, 0))
    return kind_of_law(case.law, fastest_dps).added(plain, case.seed, size_dps)


def criticised(case: Case) -> Recording:
    """Return what is criticised of a case: its first recording, and those of its experiment where it has one."""
    return joined_recording({day + 1: with_law(case, day) for day in SCHEDULES[case.schedule].days})


def outcome(case: Case) -> Outcome | None:
    """Hide a law, criticise, and compare what is proposed with the truth; None where the model absorbs the law."""
    if case.law and unit_size(case.schedule, case.seed, case.law)[1] < MIN_VISIBLE:
        return None
    recording = criticised(case)
    try:
        found = criticise(recording, usual_model(fit_data_of(recording)))
        return scored(case, found, criticised(replace(case, law="")))
    except LabctlError as error:
        return Outcome(case, "failed", failed=str(error))


def scored(case: Case, found: Criticism, plain: Recording) -> Outcome:
    """Return what a criticism says of a case; `plain` is what was criticised, without the law."""
    verdict, base = found.verdict, found.base
    assert base is not None
    first, second = found.fit_data, fit_data_of(with_law(case, 1))
    own = Witness.of(first, fit_data_of(plain))
    other = Witness.of(second, fit_data_of(recorded(case.schedule, case.seed, 1)), inside(first, second))
    model, left_dps = base.fitted.model, other.left_dps(base)
    proposals = tuple(
        Proposal(
            law.formulas, law.probability,
            own.error(model, law.fit) if case.law else np.inf, other.error(model, law.fit) if case.law else np.inf,
            other.left_dps(law.fit) / left_dps,
        )
        for law in laws_of(found)
    )  # fmt: skip
    known = own.known_form(model) if case.law else np.inf
    return Outcome(case, verdict.form, verdict.named, verdict.depends_on, proposals, known)


def cases() -> Iterator[Case]:
    """Yield every case: each law at each size, then recordings with nothing hidden."""
    for seed in range(FIRST_SEED, FIRST_SEED + SEEDS):
        for schedule in ASKED or SCHEDULES:
            yield from (Case(schedule, seed, law, z) for law in SHAPES for z in Z_LEVELS)
    for seed in range(FIRST_SEED, FIRST_SEED + NULLS):
        yield from (Case(schedule, seed) for schedule in ASKED or SCHEDULES)


Count = Callable[[Outcome], bool]
COUNTS: tuple[tuple[str, Count], ...] = (
    ("unexplained", lambda o: o.form == "unexplained"),
    ("an effect named", lambda o: bool(o.named)),
    ("law proposed", lambda o: bool(o.proposals)),
    ("likeliest: own error at most 10 %", lambda o: bool(o.proposals) and o.proposals[0].own <= GOOD),
    ("likeliest: other error at most 10 %", lambda o: bool(o.proposals) and o.proposals[0].other <= GOOD),
    ("likeliest good", lambda o: bool(o.proposals) and o.proposals[0].good),
    ("best of five good", lambda o: any(one.good for one in o.proposals)),
    ("likeliest good and verdict unexplained",
     lambda o: o.form == "unexplained" and bool(o.proposals) and o.proposals[0].good),
    ("known form at most 10 %", lambda o: o.known_form <= GOOD),
    ("likeliest leaves more of the other", lambda o: bool(o.proposals) and o.proposals[0].left > 1.0),
    ("by more than 1 %", lambda o: bool(o.proposals) and o.proposals[0].left > CLEARLY),
    ("any proposal leaves more, by more than 1 %", lambda o: any(one.left > CLEARLY for one in o.proposals)),
)  # fmt: skip


def table(found: Sequence[Outcome]) -> str:
    """Return the shares, per cent, of all cases with a law, by schedule and size."""
    hidden = [one for one in found if one.case.law]
    rows = []
    for place in (*SCHEDULES, "all"):
        here = [one for one in hidden if place in (one.case.schedule, "all")]
        by_z = [[one for one in here if one.case.z == z] for z in Z_LEVELS]
        rows.append([place, "cases", *(str(len(cell)) for cell in by_z)])
        rows += [[place, name, *(share(map(count, cell)) for cell in by_z)] for name, count in COUNTS]
    return markdown(["schedule", "%", *(f"z = {z:g}" for z in Z_LEVELS)], rows)


def null_table(found: Sequence[Outcome]) -> str:
    """Return what is proposed where nothing is hidden."""
    rows = []
    for place in (*SCHEDULES, "all"):
        here = [one for one in found if not one.case.law and place in (one.case.schedule, "all")]
        left = [one.left for outcome_ in here for one in outcome_.proposals]
        rows.append([
            place, str(len(here)),
            share(one.form != "adequate" for one in here), share(bool(one.proposals) for one in here),
            str(len(left)), str(sum(ratio > 1.0 for ratio in left)), str(sum(ratio > CLEARLY for ratio in left)),
            f"{max(left):.3f}" if left else "-",
        ])  # fmt: skip
    head = [
        "nothing hidden",
        "recordings",
        "alarm %",
        "law proposed %",
        "laws",
        "leave more",
        "by more than 1 %",
        "most",
    ]
    return markdown(head, rows)


def failures(found: Sequence[Outcome]) -> str:
    """Return every case whose likeliest proposal is not good, with what was said instead."""
    rows = [
        [one.case.schedule, one.case.law or "nothing", f"{one.case.z:g}", one.form, ", ".join(one.named) or "-",
         ", ".join(one.follows[:3]) or "-", f"{one.known_form:.2g}", *_said(one)]
        for one in found if one.failed or (one.case.law and not (one.proposals and one.proposals[0].good))
    ]  # fmt: skip
    head = ["schedule", "law", "z", "verdict", "named", "follows", "known form", "likeliest", "own", "other", "left"]
    return markdown([*head, "best of five: own, other"], rows)


def _said(one: Outcome) -> list[str]:
    best = one.best
    if best is None:
        return [one.failed or "-", "-", "-", "-", "-"]
    first = one.proposals[0]
    formulas = "; ".join(text.replace("|", "abs") for text in first.formulas)
    return [
        formulas,
        f"{first.own:.2g}",
        f"{first.other:.2g}",
        f"{first.left:.3f}",
        f"{best.own:.2g}, {best.other:.2g}",
    ]


def outcomes(asked: Iterable[Case]) -> list[Outcome]:
    """Return the outcome of each case that the model does not absorb, in their order."""
    with ProcessPoolExecutor(max_workers=WORKERS) as pool:
        return [one for one in pool.map(outcome, asked) if one is not None]


def run() -> str:
    """Return the tables."""
    found = outcomes(cases())
    return "\n\n".join([table(found), null_table(found), failures(found)])
