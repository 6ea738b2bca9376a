"""The arithmetic of the study's tables, on answers made by hand."""

from __future__ import annotations

from typing import Any

import pytest
from scipy.stats import binomtest

from studies import report_tables, scores
from studies.report_tables import Cells, wilson
from studies.scores import Said

TOOL = "a tool, means"


def answer(kind: str = "effect", z: float = 10.0, truth: str = "bias_drift", **said: Any) -> dict[str, Any]:
    hidden = {} if kind in {"nothing", "spoiled", "drifting"} else {truth: 1.0}
    plain = {"protocol": "O", "kind": kind, "z": z, "seed": 1, "hidden": hidden, "verdict": "missing", "named": [],
             "nodes": 1, "depends_on": [], "seconds": {"labctl": 0.5}}  # fmt: skip
    return {**plain, **said}


def with_tool(*named: str, **more: Any) -> dict[str, Any]:
    return answer(peers={TOOL: {"named": list(named), "seconds": 0.1}}, **more)


@pytest.mark.parametrize(("hits", "n"), [(0, 400), (1, 30), (17, 20), (50, 50)])
def test_an_interval_is_wilsons(hits: int, n: int) -> None:
    reference = binomtest(hits, n).proportion_ci(0.95, method="wilson")
    assert wilson(hits, n) == pytest.approx((reference.low, reference.high), abs=1e-12)


def test_a_share_says_per_cent_and_interval() -> None:
    assert report_tables.share([True] * 394 + [False] * 6) == "98.5 (96.8 to 99.3)"
    assert report_tables.share([]) == "-"


def test_a_group_with_the_truth_is_right_and_not_alone() -> None:
    group = answer(verdict="ambiguous", named=["thermal_lag", "bias_drift"], nodes=2)
    assert scores.right_or_group(group)
    assert not scores.right_alone(group)
    assert not scores.wrong_claim(group)


def test_likes_by_the_catalogue_are_one_name() -> None:
    turning = answer(truth="earth_rate_tilt", named=["earth_rate_tilt", "magnetic_sensitivity", "table_tilt"], nodes=2)
    assert scores.right_alone(turning)
    assert scores.wrong_single({**turning, "hidden": {"warm_up": 1.0}})


def test_another_name_is_wrong_alone_and_in_a_group() -> None:
    single = answer(named=["thermal_lag"])
    group = answer(verdict="ambiguous", named=["thermal_lag", "warm_up"], nodes=2)
    assert (scores.wrong_single(single), scores.wrong_claim(single)) == (True, True)
    assert (scores.wrong_single(group), scores.wrong_claim(group)) == (False, True)


def test_silence_is_neither_right_nor_wrong() -> None:
    silent = answer(verdict="adequate", named=[], nodes=0)
    assert not scores.right_or_group(silent)
    assert not scores.wrong_claim(silent)


def test_what_is_named_first_counts_as_the_other_tools_claims_do() -> None:
    group = answer(verdict="ambiguous", truth="bias_drift", named=["warm_up", "bias_drift"], nodes=2)
    assert scores.right_or_group(group)
    assert scores.wrong_first(group)
    like = answer(verdict="ambiguous", truth="misalignment", named=["non_orthogonality", "misalignment"])
    assert scores.right_first(like)


def test_a_second_name_beside_the_truth_is_one_too_many_but_its_like_is_not() -> None:
    assert scores.one_too_many(answer(named=["bias_drift", "warm_up"], nodes=2))
    like = answer(verdict="ambiguous", truth="misalignment", named=["misalignment", "non_orthogonality"])
    assert not scores.one_too_many(like)


def test_two_hidden_effects_want_both_names_and_no_other() -> None:
    two = answer("two", hidden={"bias_drift": 1.0, "misalignment": 1.0}, named=["non_orthogonality", "bias_drift"])
    assert scores.both_named(two)
    assert scores.both_alone({**two, "verdict": "missing"})
    assert not scores.both_alone({**two, "verdict": "ambiguous"})
    assert not scores.another_named(two)
    assert scores.another_named({**two, "named": ["bias_drift", "warm_up"]})
    assert not scores.both_named({**two, "named": ["bias_drift", "warm_up"]})


def test_outside_the_catalogue_the_right_channel_must_come_first() -> None:
    outside = answer("outside", truth="outside_etalon", verdict="unexplained", depends_on=["temperature_c", "t_s"])
    assert scores.right_channel(outside)
    assert not scores.right_channel({**outside, "depends_on": ["t_s", "temperature_c"]})
    assert not scores.right_channel({**outside, "verdict": "missing"})


def test_another_tool_claims_what_it_names_first() -> None:
    said = Said(TOOL)
    assert said.right(with_tool("bias_drift", "warm_up"))
    second = with_tool("warm_up", "bias_drift")
    assert (said.right(second), said.wrong(second), said.among(second)) == (False, True, True)
    assert said.right(with_tool("non_orthogonality", truth="misalignment"))
    silent = with_tool()
    assert (said.right(silent), said.wrong(silent), said.alarm(silent)) == (False, False, False)


def test_the_comparison_counts_each_cell_by_itself() -> None:
    answers = [
        with_tool("warm_up", kind="nothing", z=0.0, verdict="adequate", nodes=0),
        with_tool("bias_drift", z=5.0, named=["bias_drift"]),
        with_tool("warm_up", z=5.0, named=["bias_drift"]),
        with_tool("bias_drift", z=30.0, named=["warm_up"]),
    ]
    rows = [line.split(" | ") for line in report_tables.comparison(Cells(answers)).splitlines()]
    assert rows[0][2:] == [
        "right name %, z = 5",
        "right name %, z = 30",
        "wrong claim %, z = 5",
        "wrong claim %, z = 30 |",
    ]
    shares = {row[0].lstrip("| "): [cell.split()[0] for cell in row[1:]] for row in rows[2:]}
    assert shares["**labctl**, name or group"] == ["0", "100", "0", "0", "100"]
    assert shares[TOOL] == ["100", "50", "100", "50", "0"]


def test_held_out_error_is_a_median_of_those_that_could_be_fitted() -> None:
    answers = [answer(z=30.0, held_out=value) for value in (1.0, 1.1, 3.0, None)]
    assert "1.1 (2.62), 1 could not be fitted" in report_tables.extras(Cells(answers))


def test_a_report_is_made_of_few_answers_too() -> None:
    text = report_tables.report([answer("nothing", verdict="adequate", nodes=0), answer(named=["bias_drift"])], {})
    assert "1 nothing, 1 effect" in text
    assert "false alarm" in text
