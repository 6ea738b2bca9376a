"""Which rivals the data leave beside a leader: every threshold from both sides, by a pair whose figures are given."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.rivals import Pair, by_chance, cannot_be_distinguished, log_bf_beside
from labctl.fitting.criticism.verdict import has_as_simple_a_shape as measured_as_simple_a_shape

#: Twice: what noise exceeds with a probability of 0.001 in two directions is 13.8 (chi2).
TWO_DIRECTIONS = float(chi2.isf(1e-3, 2))


def candidate(effect: str, *, smooth: bool = False) -> Candidate:
    return Candidate(id=effect, smooth=smooth, log_bf=0.0, option={}, term=None, gain=0.0)


WARM_UP, SELF_HEATING = candidate("warm_up"), candidate("self_heating")


@dataclass(frozen=True)
class GivenPair(Pair):
    """A leader with 20 nats that removes a chi2 of 100, and what is given of its rival."""

    leader: Candidate = WARM_UP
    rival: Candidate = SELF_HEATING
    leader_log_bf: float = 20.0
    rival_log_bf: float = 10.0
    leader_gain: float = 100.0
    share: float = 0.5
    further_directions: int = 0
    further_gain: float = 0.0
    further_nats: float = 0.0
    has_as_simple_a_shape: bool = False
    share_by_draws: float = 0.0


def test_every_pair_has_to_state_what_the_rules_ask_for() -> None:
    computed = {"share", "further_directions", "further_gain", "further_nats", "has_as_simple_a_shape"}
    computed |= {"share_by_draws"}
    assert Pair.__abstractmethods__ == computed
    assert all(isinstance(vars(Pair)[name], property) for name in computed)
    given = [field.name for field in fields(Pair)]
    assert given == ["leader", "rival", "leader_log_bf", "rival_log_bf", "leader_gain"]


def test_what_leaves_as_much_as_noise_hides_is_another_signal() -> None:
    assert not GivenPair(share=0.0, leader_gain=7.0).contains_leader
    assert GivenPair(share=0.0, leader_gain=6.99).contains_leader


@pytest.mark.parametrize(("rival_log_bf", "stays"), [(17.01, True), (17.0, False), (25.0, True)])
def test_a_rival_with_less_than_three_nats_less_stays(rival_log_bf: float, stays: bool) -> None:
    assert cannot_be_distinguished(GivenPair(rival_log_bf=rival_log_bf)) is stays


@pytest.mark.parametrize(("share", "stays"), [(0.9301, True), (0.9299, False)])
def test_a_rival_that_leaves_a_chi2_below_seven_of_the_signal_stays_while_it_is_not_far_behind(
    share: float, stays: bool
) -> None:
    near = GivenPair(share=share, rival_log_bf=8.01)
    assert near.contains_leader is stays
    assert cannot_be_distinguished(near) is stays
    assert not cannot_be_distinguished(replace(near, rival_log_bf=8.0))  # twelve nats behind


@pytest.mark.parametrize(
    ("changed", "stays"),
    [
        ({}, True),
        ({"share": 0.995}, False),  # of a signal of 10,000 this leaves more than noise hides
        ({"further_directions": 1}, False),
        ({"rival_log_bf": 0.0}, False),  # nothing speaks for it
        ({"leader": candidate("time_delay"), "rival": candidate("bandwidth")}, False),  # both of an exact shape
        ({"leader": candidate("time_delay")}, True),
    ],
)
def test_a_rival_that_reproduces_nearly_all_with_no_more_coefficients_stays_however_far_behind(
    changed: dict[str, object], stays: bool
) -> None:
    pair = GivenPair(share=0.9951, leader_gain=1e4, rival_log_bf=0.1, leader_log_bf=500.0)
    assert cannot_be_distinguished(replace(pair, **changed)) is stays


@pytest.mark.parametrize(
    ("changed", "stays"),
    [
        ({"further_nats": 3.0}, False),  # its further coefficients are known to be 0
        ({"further_nats": 2.99}, True),
        ({"further_nats": 9.0, "has_as_simple_a_shape": True}, True),
        ({"further_nats": 9.0, "rival_log_bf": 20.0}, False),  # as probable as the leader, and no more
        ({"further_nats": 9.0, "rival_log_bf": 20.01}, True),
        ({"further_nats": 9.0, "share": 0.92}, True),  # it is another signal, so its coefficients say nothing
        ({"further_nats": 9.0, "further_directions": 0}, True),
    ],
)
def test_a_rival_that_is_the_leader_with_more_coefficients_is_judged_by_these(
    changed: dict[str, object], stays: bool
) -> None:
    pair = GivenPair(rival_log_bf=19.0, share=0.99, further_directions=1)
    assert cannot_be_distinguished(replace(pair, **changed)) is stays


@pytest.mark.parametrize(
    ("changed", "stays"),
    [
        ({"further_gain": 1.001 * TWO_DIRECTIONS}, True),  # small shifts, and the price of many coefficients
        ({"further_gain": 0.999 * TWO_DIRECTIONS}, False),
        ({"further_gain": 1.001 * TWO_DIRECTIONS, "rival": SELF_HEATING}, False),
        ({"further_gain": 1.001 * TWO_DIRECTIONS, "share": 0.5}, False),
        ({"further_gain": 1.001 * TWO_DIRECTIONS, "further_directions": 0}, False),
        ({"rival_log_bf": 17.5, "further_nats": 9.0}, True),  # near, whatever is known of its shifts
    ],
)
def test_a_shift_of_each_run_or_mounting_stays_where_noise_hardly_makes_it(
    changed: dict[str, object], stays: bool
) -> None:
    pair = GivenPair(rival=candidate("mounting_shift"), rival_log_bf=-5.0, share=0.99, further_directions=2)
    assert cannot_be_distinguished(replace(pair, **changed)) is stays


@pytest.mark.parametrize(
    ("changed", "stays"),
    [
        ({}, True),
        ({"share_by_draws": 0.995}, False),  # as one mounting of gravity up, another down
        ({"rival": SELF_HEATING}, False),  # its coefficients are no draws
        ({"leader": candidate("run_shift")}, False),  # both are
    ],
)
def test_a_shift_whose_few_draws_are_the_signal_stays_whatever_its_odds(
    changed: dict[str, object], stays: bool
) -> None:
    pair = GivenPair(
        leader=candidate("g_sensitivity"), rival=candidate("mounting_shift"), leader_log_bf=500.0, rival_log_bf=-5.0,
        leader_gain=1e4, share=1.0, share_by_draws=0.9951, further_directions=3,
    )  # fmt: skip
    assert cannot_be_distinguished(replace(pair, **changed)) is stays


@pytest.mark.parametrize(
    ("changed", "stays"),
    [
        ({}, True),
        ({"further_gain": -1.001 * TWO_DIRECTIONS}, False),  # the draws beyond the effect are larger than noise
        ({"further_gain": -1.001 * TWO_DIRECTIONS, "further_directions": 0}, True),  # there are none beyond it
        ({"share_by_draws": 0.995}, False),
        ({"rival": SELF_HEATING, "share_by_draws": 0.0}, False),
    ],
)
def test_an_effect_that_is_few_draws_of_a_shift_stays_while_the_other_draws_may_be_noise(
    changed: dict[str, object], stays: bool
) -> None:
    pair = GivenPair(
        leader=candidate("mounting_shift"), rival=candidate("g_sensitivity"), leader_log_bf=500.0, rival_log_bf=-5.0,
        leader_gain=1e4, share=0.99, share_by_draws=1.0, further_directions=-2, further_gain=-0.999 * TWO_DIRECTIONS,
    )  # fmt: skip
    assert cannot_be_distinguished(replace(pair, **changed)) is stays


def test_beside_draws_the_size_of_an_effect_is_averaged_over_as_theirs_is() -> None:
    gravity = replace(candidate("g_sensitivity"), log_bf=4.0, size_nats=7.5)
    assert log_bf_beside(gravity, candidate("mounting_shift")) == 11.5
    assert log_bf_beside(gravity, WARM_UP) == 4.0
    assert log_bf_beside(candidate("mounting_shift"), gravity) == 0.0
    assert log_bf_beside(replace(candidate("mounting_shift"), size_nats=1.0), candidate("run_shift")) == 0.0


def test_a_formula_is_a_rival_like_others() -> None:
    pair = GivenPair(rival=candidate("a formula of the user"), rival_log_bf=18.0)
    assert cannot_be_distinguished(pair)


@pytest.mark.parametrize("directions", [1, 2, 5])
def test_the_probability_of_a_gain_by_chance_is_the_share_of_noise_that_gives_it(directions: int) -> None:
    drawn = np.random.default_rng(3).chisquare(directions, 200_000)
    assert by_chance(4.0, directions) == pytest.approx(np.mean(drawn > 4.0), abs=4e-3)
    assert by_chance(-1.0, directions) == by_chance(0.0, directions) == 1.0


@dataclass(frozen=True)
class Shape:
    """A shape of a candidate on one axis, with its evidence, nats, and the number of its coefficients."""

    candidate: str
    log_bf: float
    dimensions: int = 1
    smooth: bool = False


def has_as_simple_a_shape(*axes: list[Shape]) -> bool:
    """Return what the verdict says of the rival "polynomial" beside the leader, the first shape of each axis."""
    names = [f"gyro_{number}" for number in range(len(axes))]
    comparison = SimpleNamespace(
        axes={
            name: SimpleNamespace(
                log_bf=np.array([shape.log_bf for shape in shapes]),
                dimensions=np.array([shape.dimensions for shape in shapes]),
            )
            for name, shapes in zip(names, axes, strict=True)
        },
        designs={name: SimpleNamespace(options=shapes) for name, shapes in zip(names, axes, strict=True)},
    )
    leader = SimpleNamespace(id="sine", option=dict.fromkeys(names, 0))
    return measured_as_simple_a_shape(comparison, leader, SimpleNamespace(id="polynomial"))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("shape", "is_there"),
    [
        (Shape("polynomial", 8.01), True),
        (Shape("polynomial", 8.0), False),  # twelve nats behind
        (Shape("polynomial", 25.0), True),
        (Shape("polynomial", 8.01, dimensions=2), True),  # of as many coefficients as the leader
        (Shape("polynomial", 25.0, dimensions=3), False),
        (Shape("polynomial", 25.0, smooth=True), False),
        (Shape("saturation", 25.0), False),
    ],
)
def test_a_rival_has_as_simple_a_shape_that_is_less_than_twelve_nats_behind(shape: Shape, is_there: bool) -> None:
    assert has_as_simple_a_shape([Shape("sine", 20.0, dimensions=2), shape]) is is_there


def test_how_far_a_shape_is_behind_is_added_over_the_axes() -> None:
    leader = Shape("sine", 20.0)
    assert has_as_simple_a_shape([leader, Shape("polynomial", 14.0)], [leader, Shape("polynomial", 14.1)])
    assert not has_as_simple_a_shape([leader, Shape("polynomial", 14.0)], [leader, Shape("polynomial", 14.0)])
    assert not has_as_simple_a_shape([leader, Shape("polynomial", 19.0)], [leader])
