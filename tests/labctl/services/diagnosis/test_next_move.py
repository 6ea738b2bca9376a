"""The next move of a diagnosis: which experiment, or which end. No bench and no database."""

from __future__ import annotations

import pytest

from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.criticism import CriticismResponse
from labctl.services.diagnosis.next_move import DoneExperiment, End, Measure, Progress, next_move
from tests.helpers.diagnoses import criticism, experiment

RANDOM = experiment("the rates in random order", 2.1, rate_order="random")
LONG = experiment("the temperatures up and down", 6.0, temperature_order="up_down")


def progress(*done: DoneExperiment, hours: float = 8.0, spent_hours: float = 0.0) -> Progress:
    return Progress(hours, spent_hours, done)


def ambiguous(*experiments: dict[str, object]) -> CriticismResponse:
    return criticism("ambiguous", "thermal_lag", "warm_up", experiments=experiments or (RANDOM, LONG))


def done(of: dict[str, object], came: str = "measured", took_hours: float = 2.1) -> DoneExperiment:
    return DoneExperiment(of["toml"].replace("tiny-next", "diagnosis-1-round-1"), came, of["hours"], took_hours)


@pytest.mark.parametrize(
    ("verdict", "named", "outcome", "said"),
    [
        ("adequate", (), "adequate", "after 2.0 h on the bench"),
        ("missing", ("warm_up",), "one_cause", "One cause is left: warm_up, after 2.0 h"),
        ("missing", ("warm_up", "run_shift"), "several_causes", "Missing together: warm_up, run_shift"),
        ("unexplained", (), "unexplained", "depends on temperature_c"),
        ("insufficient_data", (), "insufficient_data", "Too little was measured"),
        ("ambiguous", ("thermal_lag", "warm_up"), "indistinguishable", "thermal_lag and warm_up"),
    ],
)
def test_a_verdict_without_an_experiment_ends_it(
    verdict: CriticismVerdict, named: tuple[str, ...], outcome: str, said: str
) -> None:
    move = next_move(progress(spent_hours=2.0), criticism(verdict, *named))
    assert isinstance(move, End)
    assert (move.outcome, said in move.why) == (outcome, True), move.why


def test_the_best_experiment_is_chosen_and_explained() -> None:
    move = next_move(progress(), ambiguous())
    assert isinstance(move, Measure)
    assert move.experiment.do == RANDOM["do"]
    assert move.why == ("the rates in random order: 2.1 h on the bench are expected to say which of 2 effects it is.")


def test_one_that_was_measured_is_not_measured_again_under_whatever_name() -> None:
    move = next_move(progress(done(RANDOM), spent_hours=2.0), ambiguous())
    assert isinstance(move, Measure)
    assert move.experiment.do == LONG["do"]


def test_one_that_cannot_be_done_is_not_proposed_again() -> None:
    move = next_move(progress(done(RANDOM, "cannot_be_done")), ambiguous())
    assert isinstance(move, Measure)
    assert move.experiment.do == LONG["do"]
    both = next_move(progress(done(RANDOM, "cannot_be_done"), done(LONG, "cannot_be_done")), ambiguous())
    assert isinstance(both, End)
    assert both.outcome == "cannot_be_done"


def test_another_radius_that_cannot_be_done_is_not_proposed_with_more_repeats() -> None:
    other = {"temperatures_c": [25.0], "rates_dps": [0.0, 20.0]}
    once, often = (
        experiment(f"each position also at another distance, {times} times", another_radius=other, repeats=times)
        for times in (1, 4)
    )
    offered = ambiguous(once, often, LONG)
    declined = next_move(progress(done(once, "cannot_be_done")), offered)
    assert isinstance(declined, Measure)
    assert declined.experiment.do == LONG["do"]
    measured = next_move(progress(done(once)), offered)  # what was measured once may still be measured longer
    assert isinstance(measured, Measure)
    assert measured.experiment.do == often["do"]


def test_what_was_measured_distinguishes_no_more() -> None:
    assert isinstance(next_move(progress(), ambiguous(RANDOM)), Measure)
    move = next_move(progress(done(RANDOM)), ambiguous(RANDOM))
    assert isinstance(move, End)
    assert move.outcome == "indistinguishable"


def test_an_experiment_longer_than_the_hours_that_are_left_is_passed_over() -> None:
    move = next_move(progress(hours=5.0), ambiguous(LONG, RANDOM))
    assert isinstance(move, Measure)
    assert move.experiment.do == RANDOM["do"]
    end = next_move(progress(hours=2.0), ambiguous(LONG, RANDOM))
    assert isinstance(end, End)
    assert end.outcome == "hours_spent"
    assert "2.0 h of 2.0 h are left" in end.why
    assert "takes 2.1 h" in end.why


def test_experiments_that_took_longer_than_expected_make_the_next_ones_longer() -> None:
    late = done(LONG, took_hours=12.0)  # twice as long as expected
    move = next_move(progress(late, hours=16.0, spent_hours=12.0), ambiguous(RANDOM))
    assert isinstance(move, End)
    assert (move.outcome, "takes 4.2 h" in move.why) == ("hours_spent", True), move.why


def test_an_adequate_model_beside_which_an_effect_may_be_missing_is_measured_on() -> None:
    doubtful = criticism("adequate", experiments=(RANDOM,))
    move = next_move(progress(), doubtful)
    assert isinstance(move, Measure)
    assert move.experiment.do == RANDOM["do"]
    for end in (next_move(progress(done(RANDOM), spent_hours=2.1), doubtful), next_move(progress(hours=1.0), doubtful)):
        assert isinstance(end, End)
        assert end.outcome == "adequate"
        assert "some evidence for thermal_lag and warm_up, too little to name one of them" in end.why
