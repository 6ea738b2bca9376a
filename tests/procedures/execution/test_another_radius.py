"""Another distance from the table's axis, as the engine asks a person for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from instruments.eccentricity import Eccentricity
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import Answer
from procedures.contracts.steps import Acquire
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe
from tests.helpers.engine_rig import Rig

STATED = Eccentricity(radius_m=0.06, other_radii_m=(0.2,), outward={"z": "x"})
OTHER = {"temperatures_c": [30.0], "rates_dps": [0.0, 20.0]}


class EccentricRig(Rig):
    """A bench whose fixture can be moved to another distance."""

    def plan(self, recipe: Recipe | None = None) -> Plan:
        limits = replace(super().limits, eccentricity=STATED)
        return make_plan(recipe or self.recipe(positions=["z"], another_radius=OTHER), limits)


class Person:
    """A person who can mount units at the usual distance only."""

    def __init__(self, rig: Rig) -> None:
        self.asked: list[str] = []
        self._rig, self._text = rig, ""

    def ask(self, prompt: Any) -> None:
        self._text = prompt.text
        self.asked.append(prompt.text)

    def answer(self, prompt_id: str) -> Answer:
        can = "200 mm" not in self._text
        return Answer(prompt_id, confirmed=can, by="Bob", reason="" if can else "the plate has no holes there")

    def withdraw(self, *_: Any) -> None:
        pass


def test_a_person_who_cannot_mount_the_units_there_ends_the_campaign_with_what_was_measured() -> None:
    rig = EccentricRig()
    rig.operator = Person(rig)
    outcome = rig.run()
    assert outcome.state is CampaignState.FAILED
    assert "Bob declined" in outcome.reason
    assert "200 mm from the axis of the table" in outcome.reason
    assert "the plate has no holes there" in outcome.reason
    measured = [header.step.position for header in rig.journal.headers]
    usual = [step for step in rig.engine.plan.steps if isinstance(step, Acquire) and step.position == "zr60x"]
    assert measured == ["zr60x"] * len(usual)
    rig.assert_safe()


@pytest.mark.parametrize("at", ["zr60x", "zr200x"])
def test_with_a_fixture_that_can_be_moved_both_distances_are_measured(at: str) -> None:
    rig = EccentricRig()
    outcome = rig.run()
    assert outcome.state is CampaignState.DONE, outcome
    assert at in {header.step.position for header in rig.journal.headers}
