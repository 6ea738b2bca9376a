"""The thresholds of the verdict, each from both sides, on comparisons that are given and not computed."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from labctl.fitting.criticism import verdict as module
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.rivals import LEAD
from labctl.fitting.criticism.verdict import (
    ENOUGH,
    ENOUGH_NEXT,
    MOST,
    SAME,
    Verdict,
    alias_group,
    axes_of,
    channels_behind,
    confounded_with,
    is_of_another_law,
    judge,
    not_physical_group,
    probabilities,
    share_removed,
)

#: A step that counts, and none that rounding could make, in nats or as a share.
STEP = 1e-6
Overlaps = Callable[[dict[tuple[str, str], float]], None]


def effect(name: str, log_bf: float, *, physical: bool = True, gain: float = 50.0, **options: int) -> Candidate:
    """An effect with one direction on axis z, unless options say otherwise."""
    return Candidate(name, False, log_bf, options or {"z": 0}, None, gain, physical)


def channel(name: str, log_bf: float, **options: int) -> Candidate:
    return Candidate(name, True, log_bf, options or {"z": 0}, None, 50.0)


def compared(*candidates: Candidate, dimensions: tuple[int, ...] = (1, 2, 3), **changes: Any) -> Any:
    """What a comparison says of candidates, best first, and of the directions of its options."""
    best_first = tuple(sorted(candidates, key=lambda each: -each.log_bf))
    axis = SimpleNamespace(
        dimensions=dimensions, gain=[10.0, 0.0, 0.0], rows=20, base_columns=10, best=SimpleNamespace(chi2=20.0)
    )

    def leader(*, smooth: bool) -> Candidate | None:
        return next((each for each in best_first if each.smooth == smooth and each.physical), None)

    found = SimpleNamespace(candidates=best_first, axes={"z": axis}, designs={}, leader=leader)
    found.__dict__.update(changes)
    return found


@pytest.fixture(autouse=True)
def overlaps(monkeypatch: pytest.MonkeyPatch) -> Overlaps:
    """Say which share of one candidate's signal another reproduces; none where nothing is said, or by few draws."""
    shares: dict[tuple[str, str], float] = {}
    monkeypatch.setattr(module, "overlap", lambda _comparison, of, by: shares.get((of.id, by.id), 0.0))
    monkeypatch.setattr(module, "overlap_by_draws", lambda *_: 0.0)
    monkeypatch.setattr(module, "_further_nats", lambda *_: 0.0)
    return shares.update


@pytest.mark.parametrize(("first", "enough"), [(True, 4.5), (False, 7.0)])
def test_nothing_is_missing_below_the_evidence_that_is_enough(first: bool, enough: float) -> None:
    assert enough == (ENOUGH if first else ENOUGH_NEXT)
    below, at_limit = (judge(compared(effect("bias", e)), first=first) for e in (enough - STEP, enough))
    assert (below.form, below.group) == ("adequate", ())
    assert below.leader is not None
    assert below.share_removed == 0.0
    assert (at_limit.form, at_limit.group) == ("missing", ("bias",))


def test_without_any_candidate_nothing_is_missing() -> None:
    assert (judge(compared()).form, judge(compared()).leader) == ("adequate", None)


def test_a_channel_alone_is_unexplained_and_named_as_what_it_depends_on() -> None:
    step = judge(compared(channel("t_s", ENOUGH)))
    assert (step.form, step.group, step.depends_on) == ("unexplained", (), ("t_s",))
    assert judge(compared(channel("t_s", ENOUGH_NEXT)), first=False).form == "unexplained"


def test_an_effect_below_what_is_enough_is_not_named_beside_a_channel_that_has_it() -> None:
    step = judge(compared(effect("bias", ENOUGH - STEP), channel("t_s", ENOUGH)))
    assert (step.form, step.depends_on) == ("unexplained", ("t_s",))


@pytest.mark.parametrize(("lead", "form"), [(LEAD, "missing"), (LEAD + STEP, "unexplained")])
def test_a_simpler_channel_has_to_lead_by_more_than_20_to_1(lead: float, form: str) -> None:
    candidates = effect("bias", 10.0, z=1), channel("t_s", 10.0 + lead, z=0)
    assert judge(compared(*candidates)).form == form


@pytest.mark.parametrize(("behind", "form"), [(LEAD, "missing"), (LEAD - STEP, "unexplained"), (0.0, "unexplained")])
def test_an_effect_at_the_end_of_its_range_has_to_lead_over_every_channel(
    monkeypatch: pytest.MonkeyPatch, behind: float, form: str
) -> None:
    monkeypatch.setattr(module, "is_at_end", lambda *_: True)
    assert judge(compared(effect("self_heating", 20.0), channel("t_s", 20.0 - behind))).form == form


def test_a_channel_with_little_evidence_of_its_own_is_what_is_left_of_an_effect_at_its_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "is_at_end", lambda *_: True)
    step = judge(compared(effect("self_heating", 5.0), channel("t_s", 4.0), channel("power_s", 3.0)))
    assert (step.form, step.depends_on) == ("unexplained", ("t_s",))


def test_a_higher_order_of_what_the_base_has_is_not_named_but_an_effect_like_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "refines_base", lambda _comparison, candidate: candidate.id == "poly")
    refined = effect("poly", 20.0)
    alone = judge(compared(refined))
    assert (alone.form, alone.group, alone.leader) == ("unexplained", (), None)
    step = judge(compared(refined, effect("saturation", 19.0)))
    assert (step.form, step.group) == ("ambiguous", ("saturation", "poly"))
    assert step.leader is not None
    assert step.leader.id == "saturation"
    weak = judge(compared(effect("poly", 5.0), effect("saturation", ENOUGH - STEP)))
    assert (weak.form, weak.group) == ("unexplained", ())


def test_an_effect_like_a_refined_one_is_not_named_where_a_channel_leads_over_it(
    monkeypatch: pytest.MonkeyPatch, overlaps: Overlaps
) -> None:
    monkeypatch.setattr(module, "refines_base", lambda _comparison, candidate: candidate.id == "poly")
    comparison = compared(channel("t_s", 22.0), effect("poly", 20.0), effect("saturation", 18.0))
    assert (judge(comparison).form, judge(comparison).depends_on) == ("unexplained", ("t_s",))
    overlaps({("t_s", "saturation"): 0.75})
    assert judge(comparison).group == ("saturation", "poly")


@pytest.mark.parametrize(
    ("at_end", "refines", "another"),
    [(False, False, False), (True, False, True), (False, True, True), (True, True, True)],
)
def test_a_law_at_its_end_or_in_a_lower_order_of_the_base_is_another_one(
    monkeypatch: pytest.MonkeyPatch, at_end: bool, refines: bool, another: bool
) -> None:
    monkeypatch.setattr(module, "is_at_end", lambda *_: at_end)
    monkeypatch.setattr(module, "refines_base", lambda *_: refines)
    assert is_of_another_law(compared(), effect("poly", 9.0)) is another


@pytest.mark.parametrize(("name", "limit"), [("table_rate_dps", 0.90), ("t_s", 0.75)])
def test_a_channel_is_explained_by_an_effect_that_reproduces_enough_of_it(
    overlaps: Overlaps, name: str, limit: float
) -> None:
    candidates = effect("bias", 10.0), channel(name, 20.0)  # as many directions: neither is simpler
    overlaps({(name, "bias"): limit - STEP})
    assert judge(compared(*candidates)).form == "unexplained"
    overlaps({(name, "bias"): limit})
    assert judge(compared(*candidates)).form == "missing"


@pytest.mark.parametrize(("chi2", "form"), [(10.0 / 0.3 + 10.0, "missing"), (10.0 / 0.299 + 10.0, "ambiguous")])
def test_an_effect_that_removes_less_than_three_tenths_of_the_excess_is_not_named_alone_at_first(
    chi2: float, form: str
) -> None:
    comparison = compared(effect("bias", 20.0))
    comparison.axes["z"].best.chi2 = chi2  # beyond its 10 degrees of freedom; the effect removes 10
    step = judge(comparison)
    assert (step.form, step.group, step.share_removed) == (form, ("bias",), pytest.approx(10.0 / (chi2 - 10.0)))
    assert judge(comparison, first=False).form == "missing"


def test_the_share_removed_is_of_the_excess_over_all_axes() -> None:
    comparison = compared(effect("bias", 20.0))
    comparison.axes["x"] = SimpleNamespace(rows=30, base_columns=10, best=SimpleNamespace(chi2=50.0), gain=[25.0])
    assert share_removed(comparison, effect("bias", 1.0)) == 10.0 / (10.0 + 30.0)
    assert share_removed(comparison, effect("bias", 1.0, z=0, x=0)) == 35.0 / 40.0
    comparison.axes["x"].best.chi2 = 10.0  # below its degrees of freedom: no excess, and no negative one
    assert share_removed(comparison, effect("bias", 1.0)) == 1.0
    assert share_removed(comparison, effect("bias", 1.0, z=0, x=0)) == 1.0  # never more than all
    comparison.axes["z"].gain = [4.0, -1e-12]
    assert share_removed(comparison, effect("bias", 1.0)) == 4.0 / 10.0
    assert share_removed(comparison, effect("bias", 1.0, z=1)) == 0.0  # rounding removes nothing
    comparison.axes["z"].best.chi2, comparison.axes["z"].gain = 10.5, [0.25]
    assert share_removed(comparison, effect("bias", 1.0)) == 0.25 / 0.5
    comparison.axes["z"].best.chi2 = 10.0
    assert share_removed(comparison, effect("bias", 1.0)) == 0.0
    assert share_removed(compared(), effect("bias", 1.0, z=1)) == 0.0


@pytest.mark.parametrize(("behind", "together"), [(LEAD - STEP, True), (LEAD, False)])
def test_a_rival_less_than_20_to_1_behind_stays(behind: float, together: bool) -> None:
    leader, rival = effect("bias", 20.0), effect("scale_factor", 20.0 - behind)
    comparison = compared(leader, rival)
    assert alias_group(comparison, leader) == (("bias", "scale_factor") if together else ("bias",))
    assert judge(comparison).form == ("ambiguous" if together else "missing")


def test_a_rival_of_an_impossible_size_is_in_a_group_of_its_own() -> None:
    leader, rival = effect("bias", 20.0), effect("scale_factor", 19.0, physical=False)
    comparison = compared(leader, rival, channel("t_s", 19.0))
    assert alias_group(comparison, leader) == ("bias",)
    assert not_physical_group(comparison, leader) == ("scale_factor",)


@pytest.mark.parametrize(
    ("share", "behind", "together"),
    [
        (1 - 6.999 / 112, 11.999, True),  # leaves less than 7 of a chi2 of 112, less than 12 nats behind
        (1 - 7 / 112, 11.999, False),
        (1 - 6.999 / 112, 12.0, False),
    ],
)
def test_a_rival_that_leaves_little_of_the_signal_stays_unless_the_evidence_is_far(
    overlaps: Overlaps, share: float, behind: float, together: bool
) -> None:
    leader, rival = effect("bias", 30.0, gain=112.0), effect("scale_factor", 30.0 - behind, z=1)
    overlaps({("bias", "scale_factor"): share})
    assert alias_group(compared(leader, rival), leader) == (("bias", "scale_factor") if together else ("bias",))


@pytest.mark.parametrize(
    ("rival_id", "behind", "nats", "simple", "together"),
    [
        ("scale_factor", 1.0, LEAD - STEP, False, True),  # the further coefficients are not known to be 0
        ("scale_factor", 1.0, LEAD, False, False),
        ("scale_factor", 1.0, LEAD, True, True),  # a shape of its own does without them
        ("scale_factor", 0.0, LEAD, False, False),
        ("scale_factor", -1.0, LEAD, False, True),  # it has more evidence than the leader
        ("run_shift", 1.0, LEAD, False, True),  # shifts may be small
    ],
)
def test_a_rival_that_contains_the_leader_is_judged_by_its_further_coefficients(
    overlaps: Overlaps,
    monkeypatch: pytest.MonkeyPatch,
    rival_id: str,
    behind: float,
    nats: float,
    simple: bool,
    together: bool,
) -> None:
    leader, rival = effect("bias", 30.0, gain=112.0), effect(rival_id, 30.0 - behind, z=1)
    overlaps({("bias", rival_id): 1.0})
    monkeypatch.setattr(module, "_further_nats", lambda *_: nats)
    monkeypatch.setattr(module, "has_as_simple_a_shape", lambda *_: simple)
    assert (rival_id in alias_group(compared(leader, rival), leader)) == together


@pytest.mark.parametrize(
    ("rival_id", "further", "together"),
    [("run_shift", 10.9, True), ("run_shift", 10.8, False), ("scale_factor", 99.0, False)],
)
def test_shifts_that_noise_does_not_make_stay_beside_what_they_contain(
    overlaps: Overlaps, rival_id: str, further: float, together: bool
) -> None:
    """10.83 is the chi2 of one direction that noise passes once in a thousand times."""
    leader, rival = effect("bias", 30.0, gain=112.0), effect(rival_id, 1.0, gain=112.0 + further, z=1)
    overlaps({("bias", rival_id): 1.0})
    assert (rival_id in alias_group(compared(leader, rival), leader)) == together


@pytest.mark.parametrize(
    ("share", "option", "log_bf", "together"),
    [(0.9951, 0, 1.0, True), (0.995, 0, 1.0, False), (0.9951, 1, 1.0, False), (0.9951, 0, 0.0, False)],
)
def test_a_rival_of_no_more_coefficients_that_follows_nearly_all_stays_however_far(
    overlaps: Overlaps, share: float, option: int, log_bf: float, together: bool
) -> None:
    leader, rival = effect("not_in_the_catalogue", 99.0, gain=1e6), effect("nor_this", log_bf, z=option)
    overlaps({(leader.id, rival.id): share})
    assert (rival.id in alias_group(compared(leader, rival), leader)) == together


@pytest.mark.parametrize(
    ("leader_id", "rival_id", "together"), [("time_delay", "bandwidth", False), ("time_delay", "scale_factor", True)]
)
def test_of_two_exact_effects_the_evidence_decides(
    overlaps: Overlaps, leader_id: str, rival_id: str, together: bool
) -> None:
    leader, rival = effect(leader_id, 99.0, gain=1e6), effect(rival_id, 1.0)
    overlaps({(leader_id, rival_id): 0.9999})
    assert alias_group(compared(leader, rival), leader) == ((leader_id, rival_id) if together else (leader_id,))


def test_a_group_has_four_effects_and_those_that_are_the_same_as_the_first_or_the_last() -> None:
    leader = effect("leader", 20.0)
    exact = [effect(f"same{n}", 20.0 - 0.019 * n) for n in (0, 1)]
    others = [effect(f"other{n}", 19.5 - 0.1 * n) for n in range(6)]
    as_last = effect("as_last", others[MOST - 2].log_bf - 0.01)
    group = alias_group(compared(leader, *exact, *others, as_last), leader)
    assert group == ("leader", "same0", "same1", "other0", "other1", "other2", "as_last")
    assert alias_group(compared(leader, *others[:3]), leader) == ("leader", "other0", "other1", "other2")
    assert alias_group(compared(leader, *others[:4]), leader) == ("leader", "other0", "other1", "other2")
    not_same = effect("not_same", 20.0 - 0.021)
    assert alias_group(compared(leader, *others, not_same), leader)[:2] == ("leader", "not_same")
    assert len(alias_group(compared(leader, *others, not_same), leader)) == MOST


def test_effects_0_02_nats_apart_are_not_the_same() -> None:
    leader, far = effect("leader", SAME), [effect(f"far{n}", -0.5 - 0.1 * n) for n in range(3)]
    assert alias_group(compared(leader, effect("near", 0.0), *far), leader) == ("leader", "near", "far0", "far1")
    first, second = effect("first", 0.9), effect("second", 0.8)
    candidates = effect("leader", 1.0), first, second, effect("last", SAME), effect("not_as_last", 0.0)
    assert alias_group(compared(*candidates), candidates[0]) == ("leader", "first", "second", "last")


def test_axes_are_those_with_a_lead_of_evidence_or_all() -> None:
    comparison = SimpleNamespace(axes={
        "x": SimpleNamespace(log_bf=[LEAD - STEP, LEAD]), "y": SimpleNamespace(log_bf=[LEAD, LEAD - STEP]),
    })  # fmt: skip
    of: Any = comparison
    assert axes_of(of, effect("bias", 9.0, x=0, y=0)) == ("y",)
    assert axes_of(of, effect("bias", 9.0, x=1, y=1)) == ("x",)
    assert axes_of(of, effect("bias", 9.0, x=0, y=1)) == ("x", "y")


def test_channels_behind_a_residual_are_those_with_enough_evidence() -> None:
    candidates = channel("table_rate_dps", 9.0), channel("power_s", ENOUGH), channel("t_s", ENOUGH - STEP)
    assert channels_behind(compared(*candidates, effect("bias", 8.0))) == ("table_rate_dps", "power_s")


@pytest.mark.parametrize(
    ("first", "share", "leads"),
    [("t_s", 0.7501, True), ("chamber_c", 0.7501, True), ("t_s", 0.75, False), ("accelerometer_x", 0.99, False)],
)
def test_time_that_is_temperature_is_called_temperature(
    overlaps: Overlaps, first: str, share: float, leads: bool
) -> None:
    overlaps({(first, "temperature_c"): share})
    candidates = channel(first, 9.0), channel("table_rate_dps", 8.0), channel("temperature_c", 7.0)
    rest = (first, "table_rate_dps")
    assert channels_behind(compared(*candidates)) == (("temperature_c", *rest) if leads else (*rest, "temperature_c"))


@pytest.mark.parametrize(
    ("log_bf", "share", "named"),
    [(18.0 + STEP, 0.0, True), (18.0, 0.0, False), (1.0, 0.9001, True), (1.0, 0.9, False), (0.0, 1.0, False)],
)
def test_a_channel_is_confounded_that_the_evidence_does_not_refuse_or_that_is_explained(
    overlaps: Overlaps, log_bf: float, share: float, named: bool
) -> None:
    overlaps({("t_s", "temperature_c"): share})
    comparison = compared(channel("t_s", 30.0), channel("temperature_c", log_bf))
    assert confounded_with(comparison, "t_s") == (("temperature_c",) if named else ())


def test_weak_evidence_confounds_no_channel_however_near_the_first() -> None:
    comparison = compared(channel("t_s", ENOUGH), channel("power_s", ENOUGH), channel("temperature_c", ENOUGH - STEP))
    assert confounded_with(comparison, "t_s") == ("power_s",)


@pytest.mark.parametrize(("log_bf", "named"), [(ENOUGH - STEP, False), (ENOUGH, True)])
def test_a_channel_without_enough_evidence_of_its_own_is_compared_with_the_best_candidate(
    overlaps: Overlaps, log_bf: float, named: bool
) -> None:
    comparison = compared(effect("bias", 30.0), channel("t_s", log_bf), channel("temperature_c", ENOUGH))
    assert confounded_with(comparison, "t_s") == (("temperature_c",) if named else ())
    overlaps({("bias", "temperature_c"): 0.9001})
    assert confounded_with(comparison, "t_s") == ("temperature_c",)
    assert confounded_with(comparison, "not_compared") == ("temperature_c",)


def test_channels_are_compared_with_the_one_that_is_meant_not_with_the_strongest() -> None:
    comparison = compared(channel("power_s", 40.0), channel("t_s", 30.0), channel("temperature_c", 20.0))
    assert confounded_with(comparison, "t_s") == ("power_s", "temperature_c")
    assert confounded_with(comparison, "power_s") == ("t_s",)


def test_probabilities_are_those_of_bayes_with_nothing_missing_as_likely_as_all_effects_together() -> None:
    candidates = [effect("a", 3.0), effect("b", 1.0), effect("c", 5.0, physical=False), channel("t_s", 9.0)]
    weights = {"a": math.exp(3.0) / 3, "b": math.exp(1.0) / 3}
    total = 1.0 + sum(weights.values())
    expected = {name: pytest.approx(each / total) for name, each in weights.items()}
    assert probabilities(candidates) == {**expected, "c": 0.0}
    assert probabilities([effect("a", -50.0)])["a"] == pytest.approx(math.exp(-50.0), rel=1e-9, abs=0.0)
    assert probabilities([effect("a", 2000.0)])["a"] == pytest.approx(1.0)
    assert probabilities([]) == {}


def test_a_verdict_names_each_effect_once_and_the_first_group_that_is_none() -> None:
    said = Verdict("ambiguous", (("a",), ("b", "c"), ("c", "d")))
    assert said.named == ("a", "b", "c", "d")
    assert said.indistinguishable == ("b", "c")
    assert Verdict("missing", (("a",),)).indistinguishable == ()
