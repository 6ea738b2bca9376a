"""The sentence on an experiment: much information and no verdict is no contradiction, and the sentence says why."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest

from labctl.fitting.criticism import Forecast
from labctl.services.criticism import next_experiment as module
from labctl.services.criticism.next_experiment import REQUIRED, experiments_for
from labctl.services.planning.loading import load_bench, load_recipe
from procedures.experiments import Block

if TYPE_CHECKING:
    from labctl.fitting.criticism import Criticism
    from labctl.store import Store


def why_of(monkeypatch: pytest.MonkeyPatch, forecast: Forecast, ids: tuple[str, ...]) -> str:
    """Return the sentence on the one experiment that is offered, with this forecast, for hypotheses as likely."""
    monkeypatch.setattr(module, "all_blocks", lambda: (Block("more", "more", lambda _: {"repeats": 3}),))
    monkeypatch.setattr(module, "LONGEST_TO_REPEAT_H", 0.0)
    monkeypatch.setattr(module, "walked", lambda plan, _: plan)
    monkeypatch.setattr(module, "reduce_recording", lambda plan, **_: plan)
    monkeypatch.setattr(module, "forecast", lambda *_: forecast)
    question = SimpleNamespace(
        entropy_bit=1.0, may_join=lambda _: True, ids=ids, effects=tuple(name for name in ids if name != "nothing"),
        probabilities=np.full(len(ids), 1 / len(ids)),
    )  # fmt: skip
    monkeypatch.setattr(module, "open_question", lambda _: question)
    recipe, bench = load_recipe("quick-triaxial"), load_bench("triaxial-sim")
    monkeypatch.setattr(module, "_recipe_of", lambda *_: (recipe, bench, []))
    return experiments_for(cast("Store", None), [], cast("Criticism", None))[0]["why"]


def test_where_a_cause_is_expected_to_be_named_no_reason_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    why = why_of(monkeypatch, Forecast(0.99, 0.01, 0.8, 0.0, ()), ("sine_response", "scale_factor_odd"))
    assert why.endswith("; the probability that one cause is then named alone is 80 %.")


def test_where_none_is_expected_to_be_named_the_sentence_says_what_a_verdict_requires(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    why = why_of(monkeypatch, Forecast(0.999, 0.01, 0.0, 0.0, ()), ("sine_response", "scale_factor_odd"))
    assert "1.00 of the 1.00 bit that are missing to know which of 2 effects it is" in why
    assert (
        f"is then named alone is < 1 %: the information moves the probabilities of the effects, but {REQUIRED}." in why
    )


def test_what_an_experiment_does_not_distinguish_is_said_beside_what_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    ids = ("sine_response", "scale_factor_odd", "saturation")
    why = why_of(monkeypatch, Forecast(0.4, 0.01, 0.1, 0.0, ("sine_response", "saturation")), ids)
    assert "; if it is sine_response, this distinguishes it from saturation, and not from scale_factor_odd; " in why
    why = why_of(monkeypatch, Forecast(0.4, 0.01, 0.8, 0.0, ids), ids)
    assert "; if it is sine_response, this distinguishes it from scale_factor_odd, saturation; " in why


def test_where_nothing_may_be_missing_the_sentence_says_how_probable_that_is(monkeypatch: pytest.MonkeyPatch) -> None:
    why = why_of(monkeypatch, Forecast(0.999, 0.01, 0.0, 0.0, ()), ("nothing", "saturation"))
    assert "is < 1 %, and that none is missing is 50 % at present: the information" in why
