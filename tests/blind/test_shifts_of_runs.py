"""What differs between mountings and runs: a small effect stays evidence when recordings of other days are added."""

from __future__ import annotations

from functools import lru_cache

import pytest

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.data.joined import joined_recording
from labctl.services.criticism.next_experiment import Planned, plans_of
from studies.campaigns import protocol
from studies.diagnosis import Unit, standard
from studies.effect_sizes import sizes


@lru_cache(maxsize=1)
def experiments() -> dict[str, Planned]:
    """Return the experiments on the tri-axial bench by their words."""
    p = protocol("Y")
    return {f"{each.block.id} x{each.plan.recipe.repeats}": each for each in plans_of(p.plan.recipe, p.bench)}


def together(effect: str, seed: int, *blocks: str) -> Criticism:
    """Return a criticism of a standard campaign of three mountings and of experiments on other days."""
    unit = Unit(protocol("Y"), seed, {effect: sizes("Y")[effect]["10"]} if effect else {})
    known = standard(unit)
    parts = dict(known.parts)
    for block in blocks:
        session = len(parts) + 1
        parts[session] = unit.measure(experiments()[block].plan, session)
    return criticise(joined_recording(parts), known.model)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "blocks"),
    [
        ("g_sensitivity", ("upside_down x4",)),
        ("mounting_shift", ("upside_down x4", "power_cycles x4")),
        ("run_shift", ("one_powered_run x4", "power_cycles x4")),
    ],
)
def test_an_effect_between_mountings_is_named_alone_after_its_experiments(effect: str, blocks: tuple[str, ...]) -> None:
    found = together(effect, 140_003, *blocks).verdict
    assert (found.form, found.groups) == ("missing", ((effect,),))


@pytest.mark.slow
def test_a_unit_without_shifts_stays_adequate() -> None:
    assert together("", 140_005, "upside_down x4", "power_cycles x4").verdict.form == "adequate"
