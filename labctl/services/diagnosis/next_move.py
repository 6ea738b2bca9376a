"""The next move of a diagnosis, from what has been done so far and a criticism of all recordings together.

Nothing here knows a bench, a database or a clock.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from labctl.answers.criticism import CriticismResponse, Experiment
from labctl.answers.diagnosis import ChosenExperiment, DiagnosisOutcome, ExperimentResult
from labctl.canonical_json import canonical
from labctl.services.diagnosis import sentences


@dataclass(frozen=True)
class DoneExperiment:
    """An experiment of an earlier round."""

    toml: str
    came: ExperimentResult
    expected_hours: float
    took_hours: float  #: of the bench


@dataclass(frozen=True)
class Progress:
    """How far a diagnosis is."""

    hours: float  #: of the bench, at most
    spent_hours: float
    done: Sequence[DoneExperiment]

    @property
    def left_hours(self) -> float:
        """Bench hours that are left."""
        return max(self.hours - self.spent_hours, 0.0)

    @property
    def pace(self) -> float:
        """How much longer the experiments that were measured took than expected; at least 1."""
        measured = [each for each in self.done if each.came == "measured"]
        expected_hours = sum(each.expected_hours for each in measured)
        return max(sum(each.took_hours for each in measured) / expected_hours, 1.0) if expected_hours else 1.0


@dataclass(frozen=True)
class Measure:
    """Run an experiment."""

    experiment: ChosenExperiment
    why: str


@dataclass(frozen=True)
class End:
    """End the diagnosis."""

    outcome: DiagnosisOutcome
    why: str


def next_move(progress: Progress, criticism: CriticismResponse) -> Measure | End:
    """Return what to do after a criticism: run the best experiment that can be done, or end."""
    named = criticism.named
    match criticism.verdict:
        case "adequate":
            move = _experiment(progress, criticism) if criticism.experiments else None
            return move if isinstance(move, Measure) else _adequate(progress, criticism)
        case "missing":
            outcome: DiagnosisOutcome = "one_cause" if len(named) == 1 else "several_causes"
            return End(outcome, sentences.found(named, progress.spent_hours))
        case "unexplained":
            return End("unexplained", sentences.unexplained(criticism.depends_on))
        case "insufficient_data" if not criticism.experiments:
            return End("insufficient_data", sentences.insufficient(criticism.text))
        case _:
            return _experiment(progress, criticism)


def _adequate(progress: Progress, criticism: CriticismResponse) -> End:
    """Return the end of a diagnosis of an adequate model, with what might still be missing."""
    doubtful = list(dict.fromkeys(name for each in criticism.experiments for name in each["separates"]))
    return End("adequate", sentences.adequate(progress.spent_hours, doubtful))


def _experiment(progress: Progress, criticism: CriticismResponse) -> Measure | End:
    """Return the best experiment of a criticism; where none is left, which of the reasons ends the diagnosis."""
    named, offered = criticism.named, criticism.experiments
    if not offered:
        return End("indistinguishable", sentences.none_offered(named))
    came = _results(progress.done)
    # what cannot be done at all, such as a mounting, cannot be done with more repeats either
    impossible = {_whatever_repeats(each.toml) for each in progress.done if each.came == "cannot_be_done"}
    possible = [each for each in offered if _whatever_repeats(each["toml"]) not in impossible]
    if not possible:
        return End("cannot_be_done", sentences.none_can_be_done(named, len(offered)))
    # what an experiment has not distinguished it does not distinguish
    useful = [each for each in possible if experiment_key(each["toml"]) not in came]
    if not useful:
        return End("indistinguishable", sentences.all_were_run(named, len(possible)))
    affordable = [each for each in useful if each["hours"] * progress.pace <= progress.left_hours]
    if not affordable:
        shortest_hours = progress.pace * min(each["hours"] for each in useful)
        return End("hours_spent", sentences.hours_spent(named, progress.hours, progress.left_hours, shortest_hours))
    best = affordable[0]  # the criticism gives them in the order of what they are worth
    return Measure(_chosen(best), sentences.choice(best))


def _results(done: Sequence[DoneExperiment]) -> Mapping[str, ExperimentResult]:
    """Return what came of each experiment, by its key."""
    return {experiment_key(each.toml): each.came for each in done}


def experiment_key(toml: str) -> str:
    """Return what two recipes of the same experiment have in common: the hash of all but the name."""
    return _key(toml, frozenset({"name"}))


def _whatever_repeats(toml: str) -> str:
    """Return what recipes of the same experiment have in common, however often their rates are run."""
    return _key(toml, frozenset({"name", "repeats"}))


def _key(toml: str, left_out: frozenset[str]) -> str:
    document = {key: value for key, value in tomllib.loads(toml).items() if key not in left_out}
    return hashlib.sha256(canonical(document)).hexdigest()


def _chosen(experiment: Experiment) -> ChosenExperiment:
    return ChosenExperiment(
        separates=list(experiment["separates"]), do=experiment["do"], toml=experiment["toml"],
        power=experiment["power"], hours=experiment["hours"], per_hour=experiment["per_hour"],
    )  # fmt: skip
