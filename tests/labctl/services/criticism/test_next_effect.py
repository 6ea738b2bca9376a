"""Which effect is to be added next: one and the same for the command, the page and a program."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import pytest

from labctl.answers.criticism import Advice
from labctl.fitting.criticism import Criticism, Verdict
from labctl.services.criticism.answer import answer_of
from tests.helpers.criticism import held
from tests.helpers.simulated_recordings import single_axis


def advice(effect: str, *, add: bool) -> Advice:
    return Advice(effect=effect, add=add, why="" if add else "no better", before_dps=0.02, after_dps=0.01)


@lru_cache(maxsize=1)
def criticism() -> Criticism:
    return held(single_axis(1, scale_factor_asymmetry=4e-4))


@pytest.mark.parametrize(
    ("named", "advised", "fitted", "next_effect"),
    [
        ((), (), (), None),
        (("b", "c"), (), (), "b"),
        (("b", "c"), (), ("c",), "c"),
        (("b", "c"), (), ("a", "c"), "c"),
        (("b", "c", "d"), (("c", False), ("d", True)), ("c",), "d"),
        (("b", "c"), (("a", True),), ("c",), "c"),
    ],
    ids=["none_named", "first_named", "one_fitted", "fitted_but_not_named", "one_advised", "advised_but_not_named"],
)
def test_the_next_effect_is_advised_else_fitted_else_the_first_that_is_named(
    named: tuple[str, ...], advised: tuple[tuple[str, bool], ...], fitted: tuple[str, ...], next_effect: str | None
) -> None:
    found = criticism()
    names = dict.fromkeys((*named, *fitted))
    suspects: Any = tuple(
        SimpleNamespace(candidate=SimpleNamespace(id=name), after=object() if name in fitted else None)
        for name in names
    )
    ranked = replace(
        found,
        verdict=Verdict("ambiguous", (named,)) if named else Verdict("adequate"),
        suspects=suspects,
        advice=tuple(advice(effect, add=add) for effect, add in advised),
    )
    assert ranked.next_effect == next_effect


@pytest.mark.slow
def test_the_answer_gives_the_next_effect_of_the_criticism() -> None:
    found = held(single_axis(1, scale_factor_asymmetry=4e-4), full=True)
    assert found.next_effect in found.verdict.named
    assert answer_of("FOG-0001", 3, [7], found, []).next_effect == found.next_effect
