"""When a verdict takes an effect for the nearest one of the catalogue to another law."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.rivals import LEAD
from labctl.fitting.criticism.verdict import is_at_end, refines_base

#: What counts, and no rounding could make, in nats.
STEP = 1e-6
BIAS = Candidate("bias", False, 9.0, {"z": 0}, None, 50.0)


def lagging(*log_bf: float, tau_s: tuple[float, ...] = (100.0, 890.0, 900.0, 1000.0)) -> Any:
    """A comparison in which one effect has a shape for each time constant, with the evidence of each."""
    terms = [SimpleNamespace(parameters={"tau_s": each}) for each in tau_s]
    design = SimpleNamespace(options=[SimpleNamespace(candidate="lag", term=term) for term in terms])
    leader = Candidate("lag", False, 20.0, {"z": len(tau_s) - 1}, terms[-1], 50.0)  # type: ignore[arg-type]
    axis = SimpleNamespace(log_bf=np.array(log_bf), dimensions=[1, 1, 1, 1])
    return SimpleNamespace(designs={"z": design}, axes={"z": axis}), leader


@pytest.mark.parametrize(
    ("log_bf", "at_end"),
    [
        ((1.0, 5.0, 0.0, 8.0 + STEP), True),
        ((1.0, 5.0, 0.0, 8.0), False),
        ((1.0, 5.0, 8.0 + STEP, 0.0), True),  # 900 s is nine tenths of the longest
        ((1.0, 8.0 + STEP, 5.0, 0.0), False),
    ],
)
def test_a_law_is_another_where_the_longest_time_constant_leads(log_bf: tuple[float, ...], at_end: bool) -> None:
    comparison, leader = lagging(*log_bf)
    assert is_at_end(comparison, leader) == at_end
    assert is_at_end(comparison, BIAS) is False


@pytest.mark.parametrize(("lead", "at_end"), [(LEAD, False), (LEAD + STEP, True)])
def test_an_axis_without_another_time_constant_or_evidence_does_not_show_where_the_range_ends(
    lead: float, at_end: bool
) -> None:
    one, _ = lagging(9.0, tau_s=(100.0,))
    none, _ = lagging(-math.inf, -math.inf, 9.0, -math.inf)
    comparison, leader = lagging(0.0, 0.0, 0.0, lead)
    for axis, other in (("x", one), ("y", none)):
        comparison.designs[axis], comparison.axes[axis] = other.designs["z"], other.axes["z"]
        leader.option[axis] = 0
    assert is_at_end(comparison, leader) == at_end


def test_the_shortest_time_constant_is_judged_by_its_inverse() -> None:
    comparison, leader = lagging(8.0 + STEP, 5.0, 1.0, 0.0)
    assert is_at_end(comparison, leader, shortest=True)
    assert not is_at_end(comparison, leader)
    for second_s, at_end in ((111.0, True), (112.0, False)):  # 100 s / 111 s is more than nine tenths
        comparison, leader = lagging(0.0, 8.0, 1.0, 1.0, tau_s=(100.0, second_s, 900.0, 1000.0))
        assert is_at_end(comparison, leader, shortest=True) == at_end


def test_a_law_in_a_lower_order_of_the_base_is_refined_and_not_missing() -> None:
    def with_orders(dimensions: tuple[int, int], order: int | None = 2) -> tuple[Any, Candidate]:
        terms = [SimpleNamespace(order=each, parameters={}) for each in (1, 2, 0, None)]
        names = ("poly", "poly", "another", "poly")
        options = [SimpleNamespace(candidate=name, term=term) for name, term in zip(names, terms, strict=True)]
        options.append(SimpleNamespace(candidate="poly", term=None))
        own: Any = SimpleNamespace(order=order, parameters={})
        axes = {"z": SimpleNamespace(dimensions=[*dimensions, 0, 0, 0])}
        return SimpleNamespace(designs={"z": SimpleNamespace(options=options)}, axes=axes), Candidate(
            "poly", False, 9.0, {"z": 1}, own, 9.0
        )

    assert refines_base(*with_orders((0, 1)))
    assert not refines_base(*with_orders((1, 1)))  # nothing of the lowest order is in the base
    assert not refines_base(*with_orders((0, 1), order=1))
    assert refines_base(*with_orders((0, 1), order=None)) is False
    assert refines_base(with_orders((0, 1))[0], BIAS) is False
