"""Sentences of advice: which effect comes first and by how much, what cannot be checked, what suspects are worth."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import pytest

from labctl.fitting.criticism.suspects import Suspect, with_groups
from labctl.services.criticism.advice_text import advice_sentences, why_not_named

if TYPE_CHECKING:
    from labctl.fitting.criticism import Criticism

GROUP = ("sine_response", "scale_factor_odd")
ADVISED = {"effect": "sine_response", "add": True, "checked": True, "why": "", "before_dps": 0.5, "after_dps": 0.05}


def suspect(effect: str, log_bf: float, after_dps: float | None = None) -> Any:
    """Return a suspect with its evidence and the error of the model with it; none where it cannot be fitted."""
    error = SimpleNamespace(rms_dps=after_dps)
    return SimpleNamespace(
        candidate=SimpleNamespace(id=effect, log_bf=log_bf), share_removed=0.04, group=(effect,),
        refused="" if after_dps else "refused", after=SimpleNamespace(error=error) if after_dps else None,
    )  # fmt: skip


def criticism(suspects: list[Any], **verdict: object) -> Criticism:
    said = SimpleNamespace(groups=(GROUP,), further=(), **verdict)
    base = SimpleNamespace(error=SimpleNamespace(rms_dps=0.0481))
    made = SimpleNamespace(verdict=said, suspects=suspects, advice=[ADVISED], base=base, lack_of_fit=(1.0, None))
    return cast("Criticism", made)


def test_of_effects_that_cannot_be_distinguished_the_odds_say_why_one_comes_first() -> None:
    """The odds of each alone are beyond what is stated; those between the two are not."""
    (text,) = advice_sentences(criticism([suspect(GROUP[0], 22614.9), suspect(GROUP[1], 22611.4)]))
    assert text.startswith(
        "Adding sine_response is advised, of 2 effects that cannot be distinguished the one with the most evidence, "
        "33 to 1 against scale_factor_odd: on the parts left out of the fit, "
    )
    (text,) = advice_sentences(criticism([suspect(GROUP[0], 10.0), suspect(GROUP[1], 11.0)]))
    assert "the one with the most evidence that a calibration can carry: on the parts" in text


def test_what_cannot_be_checked_is_not_advised_against() -> None:
    unchecked = criticism([])
    unchecked.advice[:] = [{**ADVISED, "add": False, "checked": False, "why": "too few"}]  # type: ignore[index]
    assert advice_sentences(unchecked) == ["Whether to add sine_response is not known: too few."]
    unchecked.advice[:] = [{**ADVISED, "add": False, "why": "it is worse"}]  # type: ignore[index]
    assert advice_sentences(unchecked) == ["Do not add sine_response: it is worse."]


def test_the_suspect_with_which_the_error_falls_most_is_named() -> None:
    found = criticism([suspect("saturation", 7.7), suspect("scale_factor_asymmetry", 4.3, 0.04758)])
    found.verdict.further = (("saturation", "scale_factor_asymmetry"),)  # type: ignore[misc]
    text = why_not_named(found)
    assert text.startswith("Suspected and not named: saturation (2200 to 1, but the model with it cannot be fitted), ")
    assert text.endswith(" With scale_factor_asymmetry the error falls from 0.0481 to 0.04758 deg/s.")
    found.verdict.further = (("scale_factor_asymmetry",),)  # type: ignore[misc]
    assert why_not_named(found).endswith(" With it the error falls from 0.0481 to 0.04758 deg/s.")


@pytest.mark.parametrize("k", [0, 1])
def test_suspects_have_the_group_that_the_verdict_names_them_in(k: int) -> None:
    names = ("sine_response", "scale_factor_odd", "missed_steps")
    given = [
        Suspect(cast("Any", SimpleNamespace(id=name)), 0.5, 0.0, {}, True, 0.5, None, (name, "saturation"))
        for name in (*names, "dead_band")
    ]
    grouped = with_groups(given, [names])
    assert [set(each.group) for each in grouped] == [set(names)] * 3 + [{"dead_band", "saturation"}]
    assert [each.group[0] for each in grouped] == [*names, "dead_band"]
    assert with_groups(given, [(names[k],)])[k].group == (names[k],)
