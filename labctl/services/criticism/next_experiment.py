"""The next experiment: which changed recipe is expected to decide, per bench hour, which effect is missing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import tomli_w
from pydantic import ValidationError

from instruments.bench_config import BenchFile
from labctl.answers.criticism import Experiment
from labctl.errors import LabctlError
from labctl.fitting.criticism import Criticism, Forecast, OpenQuestion, forecast, open_question, reduce_recording
from labctl.log import get_logger
from labctl.probability_text import probability_text
from labctl.services.planning.attendance import visits_s
from labctl.services.planning.loading import bench_for, limits_of, load_bench
from labctl.services.simulation.walks import walked
from labctl.store import RecordingRow, Store
from procedures.contracts.errors import ProcedureError
from procedures.contracts.steps import Mount
from procedures.experiments import Block, all_blocks
from procedures.planning.plan import Plan, make_plan
from procedures.planning.step_writer import MOUNTING_S
from procedures.recipe.recipe import Recipe, recipe_document, validated_recipe

log = get_logger()

#: At most so many experiments are given: what a bench cannot do leaves others to try.
SHOWN = 12
#: An experiment that is expected to answer less than this share of the question is none.
MIN_ANSWERED = 0.05
#: Below this probability an experiment is not expected to name the cause, and is ranked by its information.
MIN_NAMING = 0.05
#: Time that a campaign takes of bench and person before its first step, h.
SET_UP_H = 0.25
#: Below this there is nothing to learn, bit.
MIN_OPEN_BIT = 0.01
#: An experiment is also planned with its rates run so many times as often, while it is shorter than this, h: the soaks
#: and mountings are the same, a weak effect needs the readings, and drift needs the time.
LONGER, LONGEST_TO_REPEAT_H = (4, 16), 6.0
#: The blocks that test a law, by the channel over which it bends most: between the levels that were measured.
BETWEEN = {"table_rate_dps": "between_rates", "temperature_c": "between_temperatures"}
#: Effects named in the sentence that explains a choice; the rest is counted.
NAMED = 3
#: Why probabilities can be known while a verdict names no cause alone.
REQUIRED = (
    "a verdict requires strong evidence for the cause, and that no other effect reproduces nearly all of the error in "
    "all recordings together"
)


@dataclass(frozen=True)
class Planned:
    """One experiment on a bench."""

    block: Block
    plan: Plan
    text: str  #: what is done, in words


@dataclass(frozen=True)
class Foreseen(Planned):
    """One experiment on a bench, and what it is expected to say."""

    forecast: Forecast
    hours: float  #: expected duration, h
    person_h: float  #: of a person at the bench, h
    mountings: int  #: after the first

    @property
    def cost_h(self) -> float:
        """Hours of the bench, set-up and a person's time counted."""
        return self.hours + SET_UP_H + self.person_h

    @property
    def bit_per_h(self) -> float:
        """Expected information per hour of the bench, set-up and a person's time counted."""
        return self.forecast.information_bit / self.cost_h

    @property
    def naming(self) -> float:
        """The probability that the verdict then names the cause alone, and rightly."""
        return _naming(self.forecast.names_one, self.forecast.names_wrong)

    @property
    def rank(self) -> tuple[float, float]:
        """What experiments are ordered by, best last: the naming of the cause per hour, then information per hour.

        Probabilities may say which cause it is long before a verdict may: a verdict also asks whether the rival
        reproduces what was measured. So an experiment that lets the verdict decide comes before one that only moves
        the probabilities; where none is expected to decide, information is what leads on.
        """
        return (self.naming / self.cost_h if self.naming >= MIN_NAMING else 0.0, self.bit_per_h)


def naming_probability(experiment: Experiment) -> float:
    """Return the probability that the verdict names the cause alone, and rightly, after an experiment, 0 to 1."""
    return _naming(experiment["power"], experiment["names_wrong"])


def _naming(names_one: float, names_wrong: float) -> float:
    return max(names_one - names_wrong, 0.0)


def experiments_for(store: Store, rows: Sequence[RecordingRow], criticism: Criticism) -> list[Experiment]:
    """Return changed recipes that are expected to say which effect is missing, best first (`Foreseen.rank`).

    `rows` are the recordings that were criticised. Nothing where the verdict leaves nothing open, or where no
    experiment that the bench can run would add anything.
    """
    question = open_question(criticism)
    base = None if question is None else _recipe_of(store, rows, criticism)
    if question is None or base is None:
        return []
    recipe, bench, done = base
    foreseen = ranked_experiments(question, recipe, bench, done)
    return [_described(each, question, recipe, len(foreseen)) for each in foreseen[:SHOWN]]


def recipe_for_laws(store: Store, rows: Sequence[RecordingRow], criticism: Criticism, channel: str) -> str:
    """Return a recipe, TOML, that measures half-way between the levels of a channel; empty where there is none.

    Laws that agree at the rates, or the temperatures, of the recordings differ between them. `rows` are the recordings
    that were criticised. What was measured already is asked for more often.
    """
    base = _recipe_of(store, rows, criticism) if criticism.data.info.motion == "rates" else None
    if base is None:
        return ""
    recipe, bench, done = base
    planned = next(law_tests(recipe, bench, channel, done), None)
    return (
        "" if planned is None else tomli_w.dumps(recipe_document(planned.plan.recipe) | {"name": f"{recipe.name}-next"})
    )


def law_tests(recipe: Recipe, bench: BenchFile, channel: str, done: Sequence[Recipe] = ()) -> Iterator[Planned]:
    """Yield the experiments between the levels of a channel that were not `done`, the shortest first."""
    known = [_what(each) for each in done]
    for planned in plans_of(recipe, bench, lambda block: block.id == BETWEEN[channel]):
        if _what(planned.plan.recipe) not in known:
            yield planned


def ranked_experiments(
    question: OpenQuestion, recipe: Recipe, bench: BenchFile, done: Sequence[Recipe] = ()
) -> list[Foreseen]:
    """Return the experiments that are made of a recipe, can be run on a bench and answer something, best first.

    One that cannot be forecast beside the recordings is left out; the log has its reason. An error of the code is no
    such reason and is raised.

    One that was `done` already is left out: what it did not say then, although it was expected to, the shapes of the
    catalogue do not describe well enough to be asked again.
    """
    if question.entropy_bit < MIN_OPEN_BIT:
        return []
    foreseen, known = [], [_what(each) for each in done]
    for each in plans_of(recipe, bench):
        plan = each.plan
        if _what(plan.recipe) in known or not question.may_join(plan.recipe.motion):
            continue
        try:
            expected = forecast(question, reduce_recording(walked(plan, bench), outliers=False))
        except (LabctlError, np.linalg.LinAlgError) as error:
            log.debug("experiment.left_out", block=each.block.id, reason=str(error))
            continue
        person_h = len(visits_s(plan, bench)) * MOUNTING_S / 3600
        mountings = max(sum(isinstance(step, Mount) for step in plan.steps) - 1, 0)
        hours = plan.expected_s / 3600
        foreseen.append(Foreseen(each.block, plan, each.text, expected, hours, person_h, mountings))
    enough = MIN_ANSWERED * question.entropy_bit
    useful = [e for e in foreseen if e.forecast.information_bit > max(enough, 2 * e.forecast.u_bit)]
    return sorted(useful, key=lambda e: e.rank, reverse=True)


def _what(recipe: Recipe) -> dict[str, object]:
    """Return what is done in a recipe, whatever it is called."""
    return recipe.model_dump(exclude={"name", "description", "seed", "fit", "stop"})


def plans_of(
    recipe: Recipe, bench: BenchFile, asked: Callable[[Block], bool] = lambda block: not block.tests_laws
) -> Iterator[Planned]:
    """Yield every installed experiment that can be made of a recipe and run on a bench, short ones also longer.

    Only those that are `asked` for; as it is, all that distinguish effects.

    One that makes no recipe, or is beyond the limits of the bench, is left out; the log has its reason.
    An experiment looks for an effect, so it does not end where U of a model without that effect is small enough.
    """
    limits, recipe = limits_of(bench, driven=True), recipe.model_copy(update={"stop": None})
    for block in filter(asked, all_blocks()):
        try:
            changed = block.changed(recipe)
            if changed is None:
                continue
            plan = make_plan(changed, limits, clip=True)
            if changed.profiles and not plan.recipe.profiles:
                continue
            yield Planned(block, plan, block.text)
            short = plan.recipe
            for times in LONGER:
                if plan.expected_s >= 3600 * LONGEST_TO_REPEAT_H:
                    break
                plan = make_plan(short.model_copy(update={"repeats": times * short.repeats}), limits)
                yield Planned(block, plan, f"{block.text}; rates {times} times as often")
        except (LabctlError, ProcedureError) as error:
            log.debug("experiment.left_out", block=block.id, reason=str(error))


def _described(foreseen: Foreseen, question: OpenQuestion, recipe: Recipe, of: int) -> Experiment:
    document = recipe_document(foreseen.plan.recipe) | {"name": f"{recipe.name}-next"}
    expected = foreseen.forecast
    leader = question.effects[0]
    return {
        "separates": [leader, *(name for name in expected.distinguished if name != leader)],
        "do": foreseen.text,
        "why": _why(foreseen, question, of),
        "block": foreseen.block.id,
        "needs": list(foreseen.block.needs),
        "recipe": document,
        "toml": tomli_w.dumps(document),
        "power": min(max(expected.names_one, 0.0), 1.0),
        "names_wrong": min(max(expected.names_wrong, 0.0), 1.0),
        "information_bit": expected.information_bit,
        "open_bit": question.entropy_bit,
        "hours": foreseen.hours,
        "person_h": foreseen.person_h,
        "mountings": foreseen.mountings,
        "per_hour": foreseen.bit_per_h,
    }


#: What experiments are ordered by, in words: whether one is expected to decide.
_ORDER = {True: "the probability per hour that one cause is then named alone", False: "expected information per hour"}


def _why(foreseen: Foreseen, question: OpenQuestion, of: int) -> str:
    """Return the sentence that explains a choice."""
    expected, leader = foreseen.forecast, question.effects[0]
    told = [name for name in expected.distinguished if name != leader]
    first = (
        f"{foreseen.hours:.2g} h on the bench are expected to give {expected.information_bit:.2f} of the "
        f"{question.entropy_bit:.2f} bit that are missing to know {_asked(question)}: "
        f"{foreseen.bit_per_h:.2g} bit/h with set-up and a person's time"
    )
    order = _ORDER[foreseen.rank[0] > 0]
    rank = f"; {of} experiments that labctl can plan from these data are ordered by {order}" if of > 1 else ""
    listed = ", ".join(told[:NAMED]) + (f" and {len(told) - NAMED} more" if len(told) > NAMED else "")
    untold = [name for name in question.effects[1:] if name not in told]
    but = f", and not from {', '.join(untold[:NAMED])}" if 0 < len(untold) <= NAMED else ""
    pair = f"; if it is {leader}, this distinguishes it from {listed}{but}" if told and foreseen.rank[0] > 0 else ""
    return f"{first}{rank}{pair}; {_naming_text(foreseen, question)}."


def _naming_text(foreseen: Foreseen, question: OpenQuestion) -> str:
    """Return with which probability a cause is named, and why that is small where much is learned nevertheless."""
    text = f"the probability that one cause is then named alone is {probability_text(foreseen.forecast.names_one)}"
    if foreseen.naming >= MIN_NAMING:
        return text
    named = zip(question.ids, question.probabilities.tolist(), strict=True)
    if nothing := [p for name, p in named if name not in question.effects]:
        text = f"{text}, and that none is missing is {probability_text(nothing[0])} at present"
    return f"{text}: the information moves the probabilities of the effects, but {REQUIRED}"


def _asked(question: OpenQuestion) -> str:
    """Return what is to be known, in words."""
    effects = question.effects
    if len(effects) == len(question.ids):
        return f"which of {len(effects)} effects it is"
    return f"whether {effects[0]} is missing" if len(effects) == 1 else f"whether one of {len(effects)} effects is"


def _recipe_of(
    store: Store, rows: Sequence[RecordingRow], criticism: Criticism
) -> tuple[Recipe, BenchFile, list[Recipe]] | None:  # fmt: skip
    """Return the largest recipe of the recordings' campaigns, the newest bench, and the recipes of all of them.

    Without a campaign a recipe like the recording, and the bench that fits it best.
    """
    recipes, bench = [], None
    for row in rows:
        if row.campaign is not None:
            campaign = store.campaigns.get(row.campaign)
            try:
                recipes.append(Recipe.model_validate(dict(campaign.recipe)))
                bench = BenchFile.model_validate(dict(campaign.bench))
            except ValidationError:  # written by another version
                continue
    if recipes and bench is not None:
        return max(recipes, key=_points), bench, recipes
    try:
        recipe = _recipe_like(criticism)
        return recipe, load_bench(bench_for(recipe)), recipes
    except (LabctlError, ProcedureError):  # no recipe, or no bench for it
        return None


def _points(recipe: Recipe) -> int:
    """Return how many different points a recipe measures."""
    return len(set(recipe.temperatures_c)) * len(set(recipe.rates_dps)) * len(set(recipe.positions))


def _recipe_like(criticism: Criticism) -> Recipe:
    """Return a recipe with the temperatures, rates, positions and durations of a recording."""
    data = criticism.data
    temperature_c = (
        data.nodes["chamber_setpoint_c"] if "chamber_setpoint_c" in data.nodes else data.nodes.temperature_c("")
    )
    levels = np.unique(np.round(data.at_sets(np.asarray(temperature_c, dtype=np.float64))))
    rates = np.unique(np.round(data.at_sets(data.nodes.table_rate_dps()), 1))
    history = data.nodes.history
    each = 1 < len(history.numbers("mounting")) <= len(history.numbers("run"))
    lasted = data.nodes.durations_s().reshape(len(data), -1).sum(axis=1)
    return validated_recipe(
        {
            "name": data.info.serial,
            "temperatures_c": levels[:: max(len(levels) // 12, 1)].tolist(),
            "rates_dps": rates[:: max(len(rates) // 25, 1)].tolist(),
            "positions": sorted(position for position, _ in data.nodes.positions()),
            "mounting": {"repower_each": each},
            "acquire": {"duration_s": float(np.clip(np.median(lasted), 1.0, 120.0))},
        }
    )
