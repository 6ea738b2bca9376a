"""Steps of the supply voltage: their plan, its limits, their run, and where a campaign is resumed among them."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from instruments.errors import LinkError
from instruments.interfaces.gyro import Channel
from instruments.interfaces.reference import ReferenceState
from instruments.interfaces.supply import SupplyLimits
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import PlanRefused, RecipeError
from procedures.contracts.steps import Acquire, PowerOn, SetSupply, Soak, Step
from procedures.execution.resume import Restart
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import parse_recipe, recipe_document
from tests.helpers.engine_rig import Rig
from tests.helpers.fake_instruments import CHAMBER, TABLE, UNIT

LIMITS = SupplyLimits(nominal_v=5.0, min_v=4.5, max_v=5.5, current_limit_a=1.0, tolerance_v=0.05)
STEPS: dict[str, Any] = {"deviations_pct": [-5.0, 0.0, 5.0], "rates_dps": [0.0, 20.0], "settle_s": 12.0}


class FakeSupply:
    """A supply whose output arrives after `late_s`; each set point is traced with that of the readings."""

    name = "supply"
    limits = LIMITS
    safe_state = "nominal"
    channels = (Channel("supply_v", "V", 1e-4),)
    late_s = 0.5

    def __init__(self, rig: Rig) -> None:
        self.rig, self.on = rig, True
        self.set_v, self.before_v, self.since_s = 5.0, 5.0, 0.0
        self.fails: list[Exception] = []

    @property
    def output_v(self) -> float:
        if not self.on:
            return 0.0
        return self.set_v if self.rig.clock.now_s() >= self.since_s + self.late_s else self.before_v

    def identify(self) -> str:
        return "fake"

    def is_on(self) -> bool:
        return self.on

    def set_voltage_v(self, voltage_v: float) -> float:
        if self.fails:
            raise self.fails.pop()
        self.before_v, self.since_s, self.set_v, self.on = self.output_v, self.rig.clock.now_s(), voltage_v, True
        self.rig.trace.append(f"supply.set {voltage_v:g}")
        return voltage_v

    def switch_off(self) -> None:
        self.on = False
        self.rig.trace.append("supply.off")

    def read(self) -> ReferenceState:
        return ReferenceState(self.rig.clock.now_s(), {"supply_v": round(self.output_v * 1e4)})

    def make_safe(self) -> float:
        self.set_v = self.before_v = LIMITS.nominal_v
        self.rig.trace.append("supply.safe")
        return self.set_v

    def close(self) -> None:
        pass


@pytest.fixture
def supplied() -> Rig:
    rig = Rig()
    rig.supply = FakeSupply(rig)
    return rig


def planned(rig: Rig, **changes: Any) -> Plan:
    return rig.plan(rig.recipe(positions=["z"], supply=STEPS | changes, repeats=2))


def of_supply(plan: Plan) -> list[Step]:
    first = next(n for n, step in enumerate(plan.steps) if isinstance(step, SetSupply))
    return [step for step in plan.steps[first:] if isinstance(step, SetSupply | Acquire)]


def test_the_voltages_are_gone_through_forwards_and_backwards_and_end_at_the_nominal_one(supplied: Rig) -> None:
    steps = of_supply(planned(supplied))
    assert [each.voltage_v for each in steps if isinstance(each, SetSupply)] == [
        4.75, 5.0, 5.25, 5.25, 5.0, 4.75, 5.0,
    ]  # fmt: skip
    assert [type(each).__name__ for each in steps[:4]] == ["SetSupply", "Acquire", "Acquire", "SetSupply"]
    assert isinstance(steps[-1], SetSupply)
    assert [each.rate_dps for each in steps if isinstance(each, Acquire)] == [0.0, 20.0] * 6
    numbers = [each.dataset for each in planned(supplied).steps if isinstance(each, Acquire)]
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_plan_without_them_is_as_before(supplied: Rig) -> None:
    recipe = supplied.recipe()
    bare = make_plan(recipe, BenchLimits(TABLE, CHAMBER, {"imu": UNIT}))
    assert bare.schedule_hash == supplied.plan(recipe).schedule_hash
    assert "supply" not in json.dumps(recipe_document(recipe))


@pytest.mark.parametrize("deviation_pct", [-11.0, 10.5, 40.0])
def test_a_voltage_outside_of_the_limits_is_refused_before_anything_moves(supplied: Rig, deviation_pct: float) -> None:
    wanted_v = LIMITS.voltage_v(deviation_pct)
    said = rf"supply\.deviations_pct {deviation_pct:g}: {wanted_v:g} V is outside the 4\.5 to 5\.5 V of the supply"
    with pytest.raises(PlanRefused, match=said):
        planned(supplied, deviations_pct=[0.0, deviation_pct])
    assert supplied.trace == []


def test_clipped_it_leaves_out_the_voltages_beyond_the_limits_and_says_so(supplied: Rig) -> None:
    recipe = supplied.recipe(positions=["z"], supply=STEPS | {"deviations_pct": [-20.0, 0.0, 5.0]})
    limits = BenchLimits(TABLE, CHAMBER, {"imu": UNIT}, supply=LIMITS)
    plan = make_plan(recipe, limits, clip=True)
    assert [each.voltage_v for each in plan.steps if isinstance(each, SetSupply)] == [5.0, 5.25, 5.0]
    assert "supply.deviations_pct -20: 4 V is outside" in plan.clipped[0]


def test_a_rate_beyond_the_table_and_a_bench_without_a_supply_are_refused(supplied: Rig) -> None:
    with pytest.raises(PlanRefused, match=r"supply\.rates_dps 900: beyond the 450 deg/s of the table"):
        planned(supplied, rates_dps=[900.0])
    supplied.supply = None
    with pytest.raises(PlanRefused, match=r"supply: the bench has no programmable supply.* add a \[supply\] section"):
        planned(supplied)


def test_a_recipe_that_leaves_no_voltage_is_refused() -> None:
    text = 'name = "r"\ntemperatures_c = [20]\nrates_dps = [0]\npositions = ["z"]\n[supply]\nrates_dps = [0]\n'
    with pytest.raises(RecipeError, match=r"-100 % leaves no voltage; give deviations of a few per cent"):
        parse_recipe(f"{text}deviations_pct = [-100]\n")


def test_each_data_set_is_read_at_its_voltage_and_the_voltage_is_logged_with_it(supplied: Rig) -> None:
    outcome = supplied.run(supplied.recipe(positions=["z"], supply=STEPS))
    assert (outcome.state, outcome.safe) == (CampaignState.DONE, True), outcome
    logged: dict[int, set[int]] = {}
    for dataset, _, readings, *_ in supplied.journal.blocks:
        logged.setdefault(dataset, set()).update(readings.raw["supply_v"].tolist())
    expected: dict[int, set[int]] = {}
    voltage_v = 5.0
    for step in supplied.engine.plan.steps:
        if isinstance(step, SetSupply):
            voltage_v = step.voltage_v
        elif isinstance(step, Acquire):
            expected[step.dataset] = {round(voltage_v * 1e4)}
    assert logged == expected
    assert supplied.trace.index("supply.safe") > supplied.trace.index("supply.set 4.75")
    assert supplied.supply.output_v == 5.0


def test_a_voltage_that_does_not_arrive_ends_the_campaign_safely(supplied: Rig) -> None:
    supplied.supply.late_s = 1e6
    outcome = supplied.run(supplied.recipe(positions=["z"], supply=STEPS))
    assert outcome.state is CampaignState.FAILED
    assert "supply: 5 V was measured" in outcome.reason
    assert "check the load and the current limit of 1 A" in outcome.reason
    assert supplied.trace.count("supply.safe") >= 1


def test_a_supply_that_falls_silent_is_asked_again(supplied: Rig) -> None:
    supplied.supply.fails = []
    engine = supplied.make(supplied.recipe(positions=["z"], supply=STEPS))

    def once(what: str, _header: Any) -> None:
        if what == "dataset_opened" and not supplied.supply.fails and "supply.set 4.75" not in supplied.trace:
            supplied.supply.fails.append(LinkError("supply", "the link was lost"))

    supplied.journal.hooks.append(once)
    outcome = engine.run()
    assert outcome.state is CampaignState.DONE, outcome
    assert supplied.supply.fails == []


def test_the_lead_in_sets_the_voltage_again_wherever_the_campaign_was_killed(supplied: Rig) -> None:
    plan = planned(supplied)
    voltage_v = None
    for index, step in enumerate(plan.steps):
        lead_in = plan.lead_in(index)
        sets = [each.voltage_v for each in lead_in if isinstance(each, SetSupply)]
        if voltage_v is not None and not isinstance(step, SetSupply) and step.kind != "safe_state":
            assert sets == [voltage_v], index
            soaks = [n for n, each in enumerate(lead_in) if isinstance(each, Soak)]
            assert all(n > lead_in.index(next(e for e in lead_in if isinstance(e, SetSupply))) for n in soaks)
        else:
            assert sets == [], index
        voltage_v = step.voltage_v if isinstance(step, SetSupply) else voltage_v


def test_a_new_powered_session_begins_at_the_nominal_voltage(supplied: Rig) -> None:
    plan = planned(supplied)
    last = max(n for n, step in enumerate(plan.steps) if isinstance(step, SetSupply) and step.voltage_v != 5.0)
    steps = (*plan.steps[: last + 1], PowerOn(run=2), *plan.steps[last + 1 :])
    powered = plan.model_copy(update={"steps": steps})
    assert not any(isinstance(each, SetSupply) for each in powered.lead_in(last + 2))


@pytest.mark.parametrize("at", [0, 2, 5])
def test_a_campaign_that_was_killed_among_the_voltages_goes_on_at_the_right_one(supplied: Rig, at: int) -> None:
    plan = planned(supplied)
    sets = [n for n, step in enumerate(plan.steps) if isinstance(step, SetSupply)]
    start_at = sets[at] + 1  # the first data set of this voltage
    voltage: Any = plan.steps[sets[at]]
    engine = supplied.make(plan.recipe)
    outcome = engine.run(start_at, Restart(gap_s=60.0))
    assert outcome.state is CampaignState.DONE, outcome
    first = supplied.journal.blocks[0]
    assert set(first[2].raw["supply_v"].tolist()) == {round(voltage.voltage_v * 1e4)}
    assert supplied.trace.index("supply.safe") < supplied.trace.index(f"supply.set {voltage.voltage_v:g}")


@pytest.mark.parametrize("at", [0, 2, 5])
def test_a_campaign_that_is_killed_while_a_voltage_is_set_sets_it_when_it_goes_on(supplied: Rig, at: int) -> None:
    plan = planned(supplied)
    index = [n for n, step in enumerate(plan.steps) if isinstance(step, SetSupply)][at]
    wanted: Any = plan.steps[index]

    def kill(what: str, step: Any) -> None:
        if (what, step) == ("step_started", index):
            raise KeyboardInterrupt

    supplied.journal.hooks.append(kill)
    with pytest.raises(KeyboardInterrupt):
        supplied.make(plan.recipe).run()
    again = Rig()
    again.supply = supplied.supply  # whatever it was left at
    again.supply.rig = again
    outcome = again.make(plan.recipe).run(index, Restart(gap_s=60.0))
    assert outcome.state is CampaignState.DONE, outcome
    assert set(again.journal.blocks[0][2].raw["supply_v"].tolist()) == {round(wanted.voltage_v * 1e4)}


def test_the_power_of_the_units_is_switched_with_the_output(supplied: Rig) -> None:
    recipe = supplied.recipe(positions=["z"], power_cycle={"count": 1, "off_s": 30.0, "rates_dps": [0.0]})
    assert supplied.run(recipe).state is CampaignState.DONE
    of_power = [each for each in supplied.trace if each.startswith(("supply.set", "supply.off", "hand.power"))]
    assert of_power == [
        "supply.set 5", "hand.power True", "hand.power False", "supply.off", "supply.set 5", "hand.power True",
    ]  # fmt: skip


def test_limits_of_an_opened_bench_have_those_of_its_supply(supplied: Rig) -> None:
    bench: Any = SimpleNamespace(table=None, chamber=None, gyros={}, supply=supplied.supply)
    assert BenchLimits.of(bench).supply == LIMITS
    assert LIMITS.complaint(5.5) is None
    assert replace(LIMITS, max_v=5.4).complaint(5.5) is not None
