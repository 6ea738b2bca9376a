"""Laws that labctl proposes once the experiments that test laws were measured: are they the hidden ones, elsewhere?

The cases are those of `studies.laws` on the published single-axis schedule. Each is criticised, and the experiment that
labctl proposes to test the likeliest law is measured as well: half-way between the rates of the recipe, or half-way
between its temperatures, as the law bends over the one or the other; without a law, the one that was measured less. All
recordings are criticised together, and so on: of an experiment that was measured, labctl asks for more readings. It
ends where the next would take the bench longer than 24 h beyond the first recording. What is proposed then is judged as
in `studies.laws`; *one of five* is the nearest of the laws that are proposed, at most five.

`LABCTL_STUDY_Z` are the sizes, with commas between them; the other variables are those of `studies.laws`. A case takes
half a minute to three minutes of one core.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from labctl.errors import LabctlError
from labctl.fitting.criticism import Criticism, bends_over, criticise, laws_of
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.models.presets import usual_model
from labctl.recording import Recording
from labctl.services.criticism.next_experiment import law_tests
from labctl.services.planning.loading import load_bench, load_recipe
from procedures.recipe.recipe import Recipe
from studies.foreign_laws import SHAPES
from studies.laws import (
    FIRST_SEED,
    GOOD,
    MIN_VISIBLE,
    PUBLISHED,
    SEEDS,
    WORKERS,
    Z_LEVELS,
    Case,
    Outcome,
    recorded_by,
    scored,
    unit_size,
    with_law_in,
)  # fmt: skip
from studies.report_tables import markdown, share

SCHEDULE, MAX_HOURS = "single-axis", 24.0
CHANNELS = ("table_rate_dps", "temperature_c")
ASKED_Z = tuple(float(z) for z in os.environ.get("LABCTL_STUDY_Z", "").split(",") if z) or Z_LEVELS


@dataclass(frozen=True)
class Followed:
    """What was said of a case in the end, and what was measured for it."""

    outcome: Outcome
    channels: tuple[str, ...]  #: between whose levels, experiment by experiment
    hours: float  #: of the bench, beyond the first recording


@dataclass
class Measured:
    """The recordings of a case so far, and what labctl said of them."""

    case: Case
    parts: list[Recording]
    plain: list[Recording]  #: the same without the law
    done: list[Recipe]
    channels: list[str]
    hours: float = 0.0

    def criticised(self) -> Criticism:
        """Return what all recordings together show beside the published model."""
        whole = joined_recording(dict(enumerate(self.parts, 1)))
        return criticise(whole, usual_model(fit_data_of(whole)))

    def next_channel(self, found: Criticism) -> str:
        """Return between the levels of which channel is measured next."""
        if laws := laws_of(found):
            return bends_over(laws[0], found)
        return min(CHANNELS, key=self.channels.count)

    def measure(self, channel: str) -> bool:
        """Measure the next experiment between the levels of a channel; returns whether there was time for one."""
        recipe, bench = load_recipe(PUBLISHED[0]), load_bench(PUBLISHED[1])
        for planned in law_tests(recipe, bench, channel, self.done):
            hours = planned.plan.expected_s / 3600
            if self.hours + hours > MAX_HOURS:
                return False
            day = 2 + len(self.channels)
            plain = recorded_by(planned.plan.recipe, PUBLISHED[1], self.case.seed, day)
            self.parts.append(with_law_in(plain, self.case))
            self.plain.append(plain)
            self.done.append(planned.plan.recipe)
            self.channels.append(channel)
            self.hours += hours
            return True
        return False


def followed(case: Case) -> Followed | None:
    """Criticise a case and measure what labctl asks for, until the hours are spent; None where the model absorbs it."""
    if unit_size(case.schedule, case.seed, case.law)[1] < MIN_VISIBLE:
        return None
    first = recorded_by(load_recipe(PUBLISHED[0]), PUBLISHED[1], case.seed, 0)
    measured = Measured(case, [with_law_in(first, case)], [first], [], [])
    try:
        while True:
            found = measured.criticised()
            channel = measured.next_channel(found)
            others = [each for each in CHANNELS if each != channel]
            if not any(measured.measure(each) for each in (channel, *others)):
                break
        plain = joined_recording(dict(enumerate(measured.plain, 1)))
        outcome = scored(case, found, plain)
    except LabctlError as error:
        outcome = Outcome(case, "failed", failed=str(error))
    return Followed(outcome, tuple(measured.channels), measured.hours)


def cases() -> Iterator[Case]:
    """Yield each law at each size."""
    for seed in range(FIRST_SEED, FIRST_SEED + SEEDS):
        yield from (Case(SCHEDULE, seed, law, z) for law in SHAPES for z in ASKED_Z)


def _other(outcome: Outcome) -> float:
    """Return the error at other rates and temperatures of the nearest proposal; infinite without one."""
    return min((one.other for one in outcome.proposals), default=np.inf)


def table(found: list[Followed]) -> str:
    """Return the shares, per cent, by size and of all."""
    sizes = sorted({one.outcome.case.z for one in found})
    columns = [*([one for one in found if one.outcome.case.z == z] for z in sizes), found]
    counts: dict[str, Callable[[Outcome], bool]] = {
        "likeliest within 10 % at the points of all recordings and on the other recording":
            lambda o: bool(o.proposals) and o.proposals[0].good,
        "likeliest within 10 % on the other recording": lambda o: bool(o.proposals) and o.proposals[0].other <= GOOD,
        "one of five within 10 % at the points of all recordings and on the other recording":
            lambda o: any(one.good for one in o.proposals),
        "one of five within 10 % on the other recording": lambda o: _other(o) <= GOOD,
        "known form with its size fitted, within 10 %": lambda o: o.known_form <= GOOD,
        "any proposal leaves more of the other recording": lambda o: any(one.left > 1.0 for one in o.proposals),
    }  # fmt: skip
    rows = [["laws", *(str(len(cell)) for cell in columns)]]
    rows += [[name, *(share(count(one.outcome) for one in cell) for cell in columns)] for name, count in counts.items()]
    rows.append(
        ["median hours beyond the first recording", *(f"{np.median([o.hours for o in c]):.1f}" for c in columns)]
    )
    return markdown(["%", *(f"z = {z:g}" for z in sizes), "all"], rows)


def missed(found: list[Followed]) -> str:
    """Return every case whose likeliest proposal is not within 10 %, with what was measured and said instead."""
    rows = []
    for one in found:
        outcome, proposals = one.outcome, one.outcome.proposals
        if proposals and proposals[0].good:
            continue
        first = proposals[0] if proposals else None
        said = (
            ["; ".join(first.formulas).replace("|", "abs"), f"{first.own:.2g}", f"{first.other:.2g}"]
            if first
            else ["-"] * 3
        )
        measured = ", ".join(channel.partition("_")[0] for channel in one.channels)
        rows.append([
            outcome.case.law, f"{outcome.case.z:g}", outcome.failed or outcome.form, ", ".join(outcome.named) or "-",
            f"{measured} ({one.hours:.1f} h)", f"{outcome.known_form:.2g}", *said, f"{_other(outcome):.2g}",
        ])  # fmt: skip
    head = ["law", "z", "verdict", "named", "measured", "known form", "likeliest", "own", "other", "best other"]
    return markdown(head, rows)


def run() -> str:
    """Return the tables."""
    with ProcessPoolExecutor(max_workers=WORKERS) as pool:
        found = [one for one in pool.map(followed, cases()) if one is not None]
    return "\n\n".join([table(found), missed(found)])
