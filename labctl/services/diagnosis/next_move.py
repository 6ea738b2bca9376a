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

#: The same experiment is measured so often; what it has not distinguished by then it does not distinguish.
MAX_RUNS = 2


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
            return End("adequate", sentences.adequate(progress.spent_hours))
        case "missing":
            outcome: DiagnosisOutcome = "one_cause" if len(named) == 1 else "several_causes"
            return End(outcome, sentences.found(named, progress.spent_hours))
        case "unexplained":
            return End("unexplained", sentences.unexplained(criticism.depends_on))
        case "insufficient_data" if not criticism.experiments:
            return End("insufficient_data", sentences.insufficient(criticism.text))
        case _:
            return _experiment(progress, criticism)


def _experiment(progress: Progress, criticism: CriticismResponse) -> Measure | End:
    """Return the best experiment of a criticism; where none is left, which of the reasons ends the diagnosis."""
    named, offered = criticism.named, criticism.experiments
    if not offered:
        return End("indistinguishable", sentences.none_offered(named))
    came = _results(progress.done)
    possible = [each for each in offered if "cannot_be_done" not in came.get(experiment_key(each["toml"]), ())]
    if not possible:
        return End("cannot_be_done", sentences.none_can_be_done(named, len(offered)))
    useful = [each for each in possible if len(came.get(experiment_key(each["toml"]), ())) < MAX_RUNS]
    if not useful:
        return End("indistinguishable", sentences.all_were_run(named, len(possible), MAX_RUNS))
    affordable = [each for each in useful if each["hours"] * progress.pace <= progress.left_hours]
    if not affordable:
        shortest_hours = progress.pace * min(each["hours"] for each in useful)
        return End("hours_spent", sentences.hours_spent(named, progress.hours, progress.left_hours, shortest_hours))
    # the criticism gives the best first; one that has been measured comes behind all that have not
    ranked = sorted(affordable, key=lambda each: len(came.get(experiment_key(each["toml"]), ())))
    return Measure(_chosen(ranked[0]), sentences.choice(ranked[0], len(ranked)))


def _results(done: Sequence[DoneExperiment]) -> Mapping[str, list[ExperimentResult]]:
    """Return what came of each experiment, by its key."""
    came: dict[str, list[ExperimentResult]] = {}
    for each in done:
        came.setdefault(experiment_key(each.toml), []).append(each.came)
    return came


def experiment_key(toml: str) -> str:
    """Return what two recipes of the same experiment have in common: the hash of all but the name."""
    document = {key: value for key, value in tomllib.loads(toml).items() if key != "name"}
    return hashlib.sha256(canonical(document)).hexdigest()


def _chosen(experiment: Experiment) -> ChosenExperiment:
    return ChosenExperiment(
        separates=list(experiment["separates"]), do=experiment["do"], toml=experiment["toml"],
        power=experiment["power"], hours=experiment["hours"], per_hour=experiment["per_hour"],
    )  # fmt: skip
