"""An experiment that cannot be run or forecast is left out and the log says why; an error of the code is raised."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.criticism import Forecast, OpenQuestion
from labctl.services.criticism import next_experiment as module
from labctl.services.criticism.next_experiment import Foreseen, plans_of, ranked_experiments
from labctl.services.planning.loading import load_bench, load_recipe
from procedures.experiments import Block, Changes
from procedures.recipe.recipe import Recipe

Forecasts = Callable[[OpenQuestion, Any], Forecast]


@pytest.fixture
def reasons(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Block id -> the reason with which it was left out, as the log has it."""
    logged: dict[str, str] = {}

    def debug(event: str, *, block: str, reason: str) -> None:
        assert event == "experiment.left_out"
        logged[block] = reason

    monkeypatch.setattr(module, "log", SimpleNamespace(debug=debug))
    return logged


def _offer(monkeypatch: pytest.MonkeyPatch, **changes: Changes) -> None:
    """Offer blocks that make these changes of a recipe, by id, and no others."""
    blocks = tuple(Block(name, name, lambda _, made=made: made) for name, made in changes.items())  # type: ignore[misc]
    monkeypatch.setattr(module, "all_blocks", lambda: blocks)


def _recipe() -> Recipe:
    return load_recipe("quick-triaxial")


def _ranked(monkeypatch: pytest.MonkeyPatch, forecast: Forecasts) -> list[Foreseen]:
    """Return the experiments ranked by a forecast that no recording is made for."""
    _offer(monkeypatch, few={"repeats": 3}, many={"repeats": 5})
    monkeypatch.setattr(module, "LONGEST_TO_REPEAT_H", 0.0)
    monkeypatch.setattr(module, "walked", lambda plan, _: plan)
    monkeypatch.setattr(module, "reduce_recording", lambda plan, **_: plan)
    monkeypatch.setattr(module, "forecast", forecast)
    question = SimpleNamespace(entropy_bit=1.0, may_join=lambda _: True)
    return ranked_experiments(cast("OpenQuestion", question), _recipe(), load_bench("triaxial-sim"))


def test_an_experiment_outside_the_limits_of_the_bench_is_left_out_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, reasons: dict[str, str]
) -> None:
    _offer(
        monkeypatch, within={"repeats": 2}, too_hot={"temperatures_c": [900.0]}, tilted={"positions": ["x+y+z"]},
        no_recipe={"repeats": 0},
    )  # fmt: skip
    assert {each.block.id for each in plans_of(_recipe(), load_bench("triaxial-sim"))} == {"within"}
    assert "temperatures_c 900: outside the -70 to 150 deg C" in reasons["too_hot"]
    assert "states no tilted fixture" in reasons["tilted"]
    assert reasons["no_recipe"].startswith("experiment no_recipe: 'repeats': ")
    assert set(reasons) == {"too_hot", "tilted", "no_recipe"}


@pytest.mark.parametrize(
    "error",
    [
        BadInput("the planned data sets lie between its temperatures"),
        NotEnoughData("too few data sets"),
        np.linalg.LinAlgError("SVD did not converge"),
    ],
)
def test_an_experiment_that_cannot_be_forecast_is_left_out_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, reasons: dict[str, str], error: Exception
) -> None:
    def forecast(_: OpenQuestion, plan: Any) -> Forecast:
        if plan.recipe.repeats == 3:
            raise error
        return Forecast(0.8, 0.01, 0.7, 0.0, ())

    assert [each.block.id for each in _ranked(monkeypatch, forecast)] == ["many"]
    assert reasons == {"few": str(error)}


def test_an_error_of_the_code_in_a_forecast_is_raised(monkeypatch: pytest.MonkeyPatch, reasons: dict[str, str]) -> None:
    def forecast(_: OpenQuestion, plan: Any) -> Forecast:
        width = 2 if plan.recipe.repeats == 3 else 3
        return Forecast(float((np.ones(3) + np.ones(width)).sum()), 0.0, 0.0, 0.0, ())

    with pytest.raises(ValueError, match="broadcast"):
        _ranked(monkeypatch, forecast)
    assert reasons == {}


def test_an_error_of_the_code_in_a_block_is_raised(monkeypatch: pytest.MonkeyPatch, reasons: dict[str, str]) -> None:
    def change(_: Recipe) -> Changes:
        return {"repeats": int(np.ones(2).reshape(3)[0])}

    monkeypatch.setattr(module, "all_blocks", lambda: (Block("wrong", "a wrong one", change),))
    with pytest.raises(ValueError, match="reshape"):
        list(plans_of(_recipe(), load_bench("triaxial-sim")))
    assert reasons == {}
