"""Experiments that settle it: one cause named alone after the standard campaign and at most 24 h of experiments.

Simulated units with one effect of the catalogue hidden at z noise units (of the standard campaign), or with none. The
standard campaign is criticised; while its verdict leaves something open, a policy chooses what is measured next, and
all recordings are criticised together. Policies: the experiment that labctl proposes first; a random one of the same
experiments; the standard campaign again. Named alone: one cause, exact aliases as one.

Beside an adequate model it goes on where an effect has some evidence. `LABCTL_STUDY_SEED` is the first seed,
`LABCTL_STUDY_UNITS` units a cell, `LABCTL_STUDY_PROTOCOLS`, `LABCTL_STUDY_Z`, `LABCTL_STUDY_POLICIES` (names with
commas) choose a part of it, `LABCTL_STUDY_EFFECTS` some of the effects.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from instruments.bench_config import BenchFile, SimulationSettings
from labctl.errors import LabctlError
from labctl.fitting.criticism import Criticism, criticise, open_question
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.criticism.next_experiment import plans_of, ranked_experiments
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import Plan
from procedures.recipe.recipe import Recipe
from studies.campaigns import MODELS, OUTSIDE, Protocol, protocol
from studies.effect_sizes import sizes
from studies.report_tables import markdown, share
from studies.scores import names

UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "100"))
PROTOCOLS = os.environ.get("LABCTL_STUDY_PROTOCOLS", "O,Y").split(",")
Z_LEVELS = tuple(os.environ.get("LABCTL_STUDY_Z", "5,10,30,100,0").split(","))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "60000"))
EFFECTS = frozenset(filter(None, os.environ.get("LABCTL_STUDY_EFFECTS", "").split(",")))
CHOSEN = os.environ.get("LABCTL_STUDY_POLICIES", "information,random,again").split(",")
#: Hours beyond the standard campaign.
MAX_HOURS = 24.0
#: Experiments of one unit, at most.
MAX_ROUNDS = 8


@dataclass(frozen=True)
class Unit:
    """A simulated unit with what is hidden in it, and its standard campaign."""

    protocol: Protocol
    seed: int
    hidden: dict[str, float]

    def measure(self, plan: Plan, session: int) -> Recording:
        """Return what a plan gives on the unit; the noise is that of the session."""
        bench = self.protocol.bench
        settings = (bench.simulation or SimulationSettings()).model_copy(update={"noise_seed": session})
        on: BenchFile = bench.model_copy(update={"simulation": settings})
        return hidden_recording(plan, on, self.protocol.gyro, self.seed, self.hidden)

    @property
    def truth(self) -> str | None:
        """The effect that is hidden."""
        return next(iter(self.hidden), None)


@dataclass
class Known:
    """What is known of a unit after some recordings."""

    unit: Unit
    parts: dict[int, Recording]
    model: ErrorModel
    found: Criticism
    hours: float = 0.0
    rounds: int = 0
    done: list[str] = field(default_factory=list)
    recipes: list[Recipe] = field(default_factory=list)  #: of the experiments
    foreseen: list[float] = field(default_factory=list)  #: probability that each leaves one cause

    def with_plan(self, plan: Plan, text: str, names_one: float | None = None) -> Known:
        """Return what is known after one more plan was measured, all recordings criticised together."""
        parts = {**self.parts, len(self.parts) + 1: self.unit.measure(plan, len(self.parts) + 1)}
        found = criticise(joined_recording(parts), self.model, full=False)
        hours = self.hours + plan.expected_s / 3600
        foreseen = [*self.foreseen, *([] if names_one is None else [names_one])]
        done, recipes = [*self.done, text], [*self.recipes, plan.recipe]
        return Known(self.unit, parts, self.model, found, hours, self.rounds + 1, done, recipes, foreseen)


#: What is measured next, in words, and the probability that it leaves one cause; None: there is nothing to choose.
Choice = tuple[Plan, str, float | None] | None
Policy = Callable[[Known, np.random.Generator], Choice]


def by_information(known: Known, _: np.random.Generator) -> Choice:
    """Choose the experiment that labctl proposes first of those that the hours left allow."""
    question = open_question(known.found)
    if question is None:
        return None
    recipe, bench = known.unit.protocol.plan.recipe, known.unit.protocol.bench
    for each in ranked_experiments(question, recipe, bench, known.recipes):
        if known.hours + each.hours <= MAX_HOURS:
            bit, one = each.forecast.information_bit, each.forecast.names_one
            return each.plan, f"{each.block.id} {each.hours:.1f} h {bit:.2f} bit {one:.2f}", one
    return None


def at_random(known: Known, rng: np.random.Generator) -> Choice:
    """Choose one of the experiments that the hours left allow."""
    recipe, bench = known.unit.protocol.plan.recipe, known.unit.protocol.bench
    left = [each for each in plans_of(recipe, bench) if known.hours + each.plan.expected_s / 3600 <= MAX_HOURS]
    if not left:
        return None
    chosen = left[int(rng.integers(len(left)))]
    return chosen.plan, chosen.text, None


def again(known: Known, _: np.random.Generator) -> Choice:
    """Choose the standard campaign once more, the first one whatever it takes."""
    plan = known.unit.protocol.plan
    fits = known.rounds == 0 or known.hours + plan.expected_s / 3600 <= MAX_HOURS
    return (plan, "again", None) if fits else None


POLICIES: dict[str, Policy] = {"information": by_information, "random": at_random, "again": again}


@dataclass(frozen=True)
class Outcome:
    """What one policy led to on one unit."""

    policy: str
    alone: bool  #: the hidden effect named, and nothing else but its exact aliases; with nothing hidden: adequate
    wrong: bool  #: one cause named, and it is another
    hours: float
    form: str
    groups: tuple[tuple[str, ...], ...]
    done: tuple[str, ...]
    foreseen: tuple[float, ...]  #: probability that each experiment leaves one cause alone


def units(name: str, z: str) -> Iterator[Unit]:
    """Yield the units of a cell, the effects drawn evenly from those that the protocol can show; z = 0: nothing."""
    p, sized = protocol(name), sizes(name)
    effects = sorted(each for each in set(sized) - set(OUTSIDE) if not EFFECTS or each in EFFECTS)
    order = np.random.default_rng(60_000).permutation(len(effects))
    for k in range(UNITS):
        effect = effects[int(order[k % len(effects)])]
        yield Unit(p, FIRST_SEED + k, {} if z == "0" else {effect: sized[effect][z]})


def standard(unit: Unit) -> Known:
    """Return what the standard campaign says of a unit."""
    first = unit.measure(unit.protocol.plan, 1)
    model, _ = preset_for(MODELS[unit.protocol.name], []).build(fit_data_of(first))
    return Known(unit, {1: first}, model, criticise(first, model, full=False))


def followed(known: Known, policy: Policy) -> Known:
    """Return what is known after a policy was followed while the verdict leaves something open."""
    rng = np.random.default_rng([known.unit.seed, 7])
    while _is_open(known.found) and known.rounds < MAX_ROUNDS:
        chosen = policy(known, rng)
        if chosen is None:
            break
        try:
            known = known.with_plan(*chosen)
        except LabctlError as error:
            known.done.append(f"refused: {error}")
            break
    return known


def _is_open(found: Criticism) -> bool:
    """Return whether a diagnosis goes on: one of several effects is missing, or one may be."""
    return found.verdict.form == "ambiguous" or open_question(found) is not None


def outcome(known: Known, policy: str) -> Outcome:
    """Return how what is known counts."""
    verdict, truth = known.found.verdict, known.unit.truth
    groups = verdict.groups
    single = len(groups) == 1 and set(groups[0]) <= names(groups[0][0])
    right = single and truth is not None and groups[0][0] in names(truth)
    wrong = (single and not right) if truth is not None else bool(groups)
    alone = right if truth is not None else verdict.form == "adequate"
    return Outcome(policy, alone, wrong, known.hours, verdict.form, groups, tuple(known.done), tuple(known.foreseen))


def cell(name: str, z: str, policies: Sequence[str]) -> list[list[str]]:
    """Return the rows of a cell: the standard campaign, and each policy after it."""
    outcomes: dict[str, list[Outcome]] = {each: [] for each in ("standard", *policies)}
    for unit in units(name, z):
        first = standard(unit)
        outcomes["standard"].append(outcome(first, "standard"))
        for policy in policies:
            result = outcome(followed(first, POLICIES[policy]), policy)
            outcomes[policy].append(result)
            if result.done:
                print(f"  {unit.truth} z={z} {policy}: {result.form} {result.groups} {result.done}", flush=True)
    return [_row(name, z, policy, found) for policy, found in outcomes.items()]


def _row(name: str, z: str, policy: str, found: list[Outcome]) -> list[str]:
    extra = [each.hours for each in found if each.done]
    hours = f"{np.median(extra):.1f} ({len(extra)})" if extra else "-"
    last = [o for o in found if o.foreseen]
    rounds = sum(len(o.foreseen) for o in last)
    met = f"{sum(sum(o.foreseen) for o in last):.1f} / {sum(o.form == 'missing' for o in last)} of {rounds}"
    shares = share(o.alone for o in found), share(o.wrong for o in found)
    return [name, z, policy, *shares, hours, met if last else "-"]


def run() -> str:
    """Print each cell as it is done, and return the table."""
    head = [
        "protocol",
        "z",
        "policy",
        "named alone %",
        "wrong name %",
        "median extra h (units with any)",
        "one cause: foreseen / seen",
    ]
    rows = []
    for name in PROTOCOLS:
        for z in Z_LEVELS:
            begun = time.process_time()
            rows += cell(name, z, CHOSEN)
            print(markdown(head, rows[-1 - len(CHOSEN) :]), f"\n{time.process_time() - begun:.0f} s", flush=True)
    return markdown(head, rows)


def main() -> None:
    """Run the study."""
    print(run())


if __name__ == "__main__":
    main()
