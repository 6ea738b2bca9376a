"""A campaign that ends before its plan does, because enough is measured."""

from __future__ import annotations

from typing import Any

import pytest

from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import Event
from procedures.contracts.sufficiency import Sufficiency
from procedures.execution.resume import Restart

REACHED = "U 0.0029 deg/s reached the target 0.003 deg/s"


class AfterSome:
    """Says that it is enough after so many data sets."""

    def __init__(self, sets: int) -> None:
        self.sets, self.asked, self.concluded = sets, 0, ""

    def ask(self) -> Sufficiency:
        self.asked += 1
        events = (Event("uncertainty", f"U after {self.asked}", value=1.0 / self.asked),)
        return Sufficiency(events, REACHED if self.asked >= self.sets else "")

    def conclude(self, enough: str) -> Sufficiency:
        self.concluded = enough
        return Sufficiency((), enough or "U is above the target")

    def close(self) -> None: ...


def outcomes(rig: Any) -> list[str]:
    return [result.outcome for result in rig.journal.results()]


def test_the_rest_of_the_fitted_data_sets_is_skipped_and_the_campaign_is_done(rig: Any) -> None:
    monitor = AfterSome(1)
    outcome = rig.run(sufficiency=monitor)
    steps = rig.engine.plan.steps
    sets = [n for n, step in enumerate(steps) if step.kind == "acquire"]
    skipped = [n for n, each in enumerate(outcomes(rig)) if each == "skipped"]
    assert skipped == list(range(sets[0] + 1, sets[-1] + 1))
    assert {result.reason for result in rig.journal.results() if result.outcome == "skipped"} == {REACHED}
    assert outcome.state is CampaignState.DONE
    assert outcome.reason == f"{REACHED}; {len(skipped)} steps were skipped, because they are not needed"
    assert (monitor.asked, monitor.concluded) == (1, REACHED)
    assert len(rig.journal.headers) == 1
    assert [event.kind for event in rig.journal.events if event.kind in {"uncertainty", "enough"}] == [
        "uncertainty",
        "enough",
    ]
    rig.assert_safe()


def test_a_campaign_that_is_never_enough_goes_to_its_end_and_says_so(rig: Any) -> None:
    outcome = rig.run(sufficiency=AfterSome(1000))
    assert set(outcomes(rig)) == {"done"}
    assert outcome.reason == "U is above the target; all steps done"


def test_enough_at_the_last_data_set_skips_nothing(rig: Any) -> None:
    sets = sum(step.kind == "acquire" for step in rig.plan().steps)
    outcome = rig.run(sufficiency=AfterSome(sets))
    assert set(outcomes(rig)) == {"done"}
    assert outcome.reason.endswith("all steps done")


def test_what_verifies_is_measured_also_where_the_fitted_part_ends_early(rig: Any) -> None:
    recipe = rig.recipe(verification={"temperatures": 1, "rates": 3})
    rig.run(recipe, sufficiency=AfterSome(1))
    taken = [header.step.verification for header in rig.journal.headers]
    assert taken.count(False) == 1
    assert taken.count(True) == sum(getattr(step, "verification", False) for step in rig.engine.plan.steps) > 0


def test_what_an_earlier_process_skipped_is_counted_after_a_power_cut(rig: Any) -> None:
    steps = rig.plan().steps
    sets = [n for n, step in enumerate(steps) if step.kind == "acquire"]
    skipped = frozenset(range(sets[-2] + 1, sets[-1] + 1))
    restart = Restart(gap_s=5.0, skipped=skipped)
    outcome = rig.run(start_at=sets[-1] + 1, restart=restart, sufficiency=AfterSome(1))
    assert f"{len(skipped)} steps were skipped, because they are not needed" in outcome.reason
    assert rig.journal.headers == []


@pytest.mark.parametrize(
    ("stop", "text"),
    [
        ({"u_dps": 0.003}, "nothing says what is fitted"),
        ({"u_dps": 0.0, "model": "bias_scale"}, "greater than 0"),
        ({"u_dps": 0.003, "model": "bias_scale", "rates_dps": [20, 0]}, "above the second"),
        ({"u_dps": 0.003, "model": "bias_scale", "rates_dps": [0, 30]}, "beyond what the recipe measures, 0 to 20"),
        ({"u_dps": 0.003, "model": "bias_scale", "temperature_c": [20, 30]}, "beyond what the recipe measures, 30 to"),
    ],
)
def test_rules_that_cannot_be_met_are_refused(rig: Any, stop: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        rig.recipe(stop=stop)


def test_the_model_of_the_fit_is_taken_where_none_is_named(rig: Any) -> None:
    recipe = rig.recipe(stop={"u_dps": 0.003}, fit={"model": "bias_scale"})
    assert recipe.stop.model == "bias_scale"
    assert (
        rig.recipe(stop={"u_dps": 0.003, "model": "ojeda2000"}, fit={"model": "bias_scale"}).stop.model == "ojeda2000"
    )
