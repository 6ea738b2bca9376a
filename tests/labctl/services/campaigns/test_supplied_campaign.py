"""Campaigns on a bench with a programmable supply: what is logged, where they are resumed, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.errors import NoReply
from labctl.answers.campaigns import ResumeRequest
from labctl.errors import BadInput
from labctl.recording import Recording
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.campaigns.resume import prepare_resume
from labctl.services.planning.loading import with_drivers
from labctl.store import Store, open_store
from procedures.contracts.control import Control
from procedures.contracts.errors import PlanRefused
from tests.helpers.supplied_bench import with_supply

RECIPE: dict[str, Any] = {
    "name": "supplied", "temperatures_c": [25], "rates_dps": [0, 20], "positions": ["z"],
    "soak": {"hold_s": 5, "max_drift_c": 5.0, "drift_window_s": 10}, "acquire": {"duration_s": 5, "settle_s": 1},
    "supply": {"deviations_pct": [-5, 5], "rates_dps": [0, 20], "settle_s": 5},
}  # fmt: skip
#: Of the data sets in order: two at the level, two each at 95 and 105 % of 5 V.
VOLTAGES_V = [5.0, 5.0, 4.75, 4.75, 5.25, 5.25]


def recipe_in(folder: Path, **supply: Any) -> str:
    path = folder / "supplied.toml"
    path.write_text(tomli_w.dumps(RECIPE | {"supply": RECIPE["supply"] | supply}), encoding="utf-8")
    return str(path)


def bench_of(**settings: Any) -> BenchFile:
    return with_drivers(with_supply(read_bench("single-axis-sim"), **settings))


def killed_in(store: Store, recipe: str, bench: BenchFile, step: str, silent: str = "table") -> int:
    """Run a campaign whose table or supply falls silent in a step; returns its number."""
    prepared = prepare(store, recipe, bench, VirtualClock(), clip=False)

    def silence(progress: Any) -> None:
        if step in progress.step_text and progress.state == "running":

            def fail(*_: Any) -> None:
                raise NoReply(silent, "no answer")

            table, supply = (getattr(prepared.bench, name) for name in ("table", "supply"))
            if silent == "table":
                table.spin = fail
            else:
                supply.set_voltage_v = fail

    assert run(store, prepared, Control(), silence).state == "failed"
    return prepared.id


def resumed_at_right_voltages(store: Store, number: int, bench: BenchFile) -> Recording:
    """Resume a campaign to its end, hold each data set's voltage to the recipe's, and return what was recorded."""
    request = ResumeRequest(by="Ada", power="kept")
    prepared = prepare_resume(store, number, bench, lambda point: VirtualClock(point.last_at), request)
    answer = run(store, prepared, Control(), lambda _: None)
    assert answer.state == "done"
    points = store.recordings.points(answer.recordings["FOG-0001"])
    assert np.asarray(points.columns["supply_v"], dtype=np.float64) == pytest.approx(VOLTAGES_V, abs=0.01)
    supply: Any = prepared.bench.supply
    assert supply.limits.nominal_v == 5.0
    return points


@pytest.mark.parametrize("voltage", ["4.75 V", "5.25 V", "5 V"])
def test_killed_in_a_step_of_the_supply_it_sets_that_voltage_again(tmp_path: Path, voltage: str) -> None:
    bench = bench_of()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        number = killed_in(store, recipe_in(tmp_path), bench, f"supply of the units to {voltage}", "supply")
        resumed_at_right_voltages(store, number, bench)


@pytest.mark.parametrize("safe_state", ["nominal", "off"])
def test_killed_in_the_middle_it_goes_on_at_the_right_voltage(tmp_path: Path, safe_state: str) -> None:
    bench = bench_of(safe_state=safe_state)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        number = killed_in(store, recipe_in(tmp_path), bench, "data set 6 of")
        points = resumed_at_right_voltages(store, number, bench)
        runs = np.asarray(points.columns["run"]).tolist()
        assert runs == ([1] * 6 if safe_state == "nominal" else [1] * 5 + [2])  # off: another powered session


def test_a_voltage_outside_of_the_limits_is_refused_and_no_campaign_is_written(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        recipe = recipe_in(tmp_path, deviations_pct=[-5, 40])
        with pytest.raises(PlanRefused, match=r"supply\.deviations_pct 40: 7 V is outside the 4\.5 to 5\.5 V"):
            prepare(store, recipe, bench_of(), VirtualClock(), clip=False)
        with pytest.raises(PlanRefused, match="the bench has no programmable supply"):
            prepare(store, recipe, with_drivers(read_bench("single-axis-sim")), VirtualClock(), clip=False)
        assert store.campaigns.last_on_bench("single-axis-sim") is None


def test_a_column_that_a_reference_has_already_is_refused(tmp_path: Path) -> None:
    reference = {
        "driver": "line-reference", "port": "sim://line-reference/reference", "identity": "",
        "quantities": {"supply_v": {"ask": "FETCH?", "unit": "V"}},
    }  # fmt: skip
    record = bench_of().model_dump(exclude={"drivers", "reported"}) | {"references": [reference]}
    bench = with_drivers(BenchFile.model_validate(record))
    with (
        open_store(str(tmp_path / "lab.sqlite"), write=True) as store,
        pytest.raises(BadInput, match=r'column supply_v has another source.* or column = "other_supply_v" in \[supply'),
    ):
        prepare(store, recipe_in(tmp_path), bench, VirtualClock(), clip=False)
