"""HTTP: recipes and plans before anything moves, and a campaign's steps while it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import VirtualClock
from labctl.services.campaigns.plan_view import _forecast
from labctl.services.campaigns.preparation import prepare
from labctl.store import StepRow, Store
from procedures.recipe.recipe import shipped_recipes
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES
from tests.helpers.service import open_client, service_of

FOG = "OSU-FOG-2024"
ENDLESS = """
format = "labctl-recipe/1"
name = "endless"
temperatures_c = [25]
rates_dps = [0, 10]
positions = ["z"]
repeats = 1000000000
"""
LONG = ENDLESS.replace("1000000000", "2").replace("positions", "warm_up_s = 9e6\npositions")


def test_recipes_say_what_they_take_here_or_why_not(client: TestClient) -> None:
    rows = {row["name"]: row for row in client.get("/api/recipes").json()}
    assert set(rows) == set(shipped_recipes())
    short = rows["short"]
    assert (short["bench"], short["datasets"], short["refused"], short["remark"]) == ("single-axis-sim", 15, None, "")
    assert short["expected_s"] > 1000
    assert 'name = "short"' in short["text"]
    assert short["description"].startswith("First try")
    triaxial = rows["table1-x-table2"]
    assert triaxial["expected_s"] is None
    assert "beyond the" in triaxial["refused"]
    assert "about x, y" in triaxial["remark"]


def test_a_plan_can_be_drawn_before_anything_moves(client: TestClient) -> None:
    plan = client.post("/api/plans", json={"recipe": "short"}).json()
    line = plan["timeline"]
    assert {len(values) for values in line.values()} == {plan["steps"]}
    assert [number for number in line["dataset"] if number] == list(range(1, plan["datasets"] + 1))
    assert line["start_s"][-1] + line["expected_s"][-1] == pytest.approx(plan["expected_s"])
    first = line["kind"].index("acquire")
    assert (line["temperature_c"][first], line["rate_dps"][first], line["position"][first]) == (24, -40, "z")
    assert line["rate_dps"][first - 1] is None
    assert plan["visibility"] is None
    assert client.get("/api/campaigns").json() == []
    seen = client.post("/api/plans", json={"recipe": "short", "visibility": True}).json()
    assert "scale_factor_asymmetry" in {each["effect"] for each in seen["visibility"]}


@pytest.mark.parametrize(
    ("body", "slug", "says"),
    [
        ({"recipe": "/etc/passwd"}, "recipe", "send the text of a recipe, or one of"),
        ({"recipe": "table1-x-table2"}, "plan-refused", "beyond the"),
        ({"recipe": ENDLESS}, "plan-refused", "but a campaign may have at most 100000"),
        ({"recipe": LONG, "visibility": True}, "bad-input", "visibility: the plan takes 104 days"),
    ],
)
def test_what_cannot_be_planned_says_why(client: TestClient, body: dict[str, Any], slug: str, says: str) -> None:
    answer = client.post("/api/plans", json=body)
    assert answer.json()["type"] == f"urn:labctl:problem:{slug}"
    assert says in answer.json()["detail"]


MORE_RATES = """format = "labctl-recipe/1"
name = "more-rates"
temperatures_c = [37]
rates_dps = [-100, -90, -80, 0, 80, 90, 100]
positions = ["z"]
"""


@pytest.mark.slow
def test_a_next_experiment_is_judged_beside_the_version_that_it_is_for(tmp_path: Path) -> None:
    """The model of the version is no first model, and its recording has the temperatures that the plan lacks."""
    lab = Lab(tmp_path)
    lab.run("import", str(EXAMPLES / "osu-fog"))
    lab.run("fit", FOG, "--model", "bias_scale")
    with open_client(lab.database) as client:
        asked = {"recipe": MORE_RATES, "visibility": True}
        alone, beside, unknown, recordless = (
            client.post("/api/plans", json={**asked, **more})
            for more in ({}, {"unit": FOG, "version": 1}, {"unit": FOG, "version": 7}, {"unit": "NONE"})
        )
    first, then = ({row["effect"]: row for row in each.json()["visibility"]} for each in (alone, beside))
    assert not first["scale_factor_odd"]["visible"]  # the surface of a first fit has it
    assert then["scale_factor_odd"]["visible"]
    assert not then["scale_factor_odd"]["in_model"]
    assert then["bias_temperature"]["in_model"]
    assert then["warm_up"]["needs"] == ["power_s"]  # which the recording lacks
    assert (unknown.status_code, recordless.status_code) == (404, 404)
    recipe = tmp_path / "more-rates.toml"
    recipe.write_text(MORE_RATES, encoding="utf-8")
    printed = lab.json("campaign", "plan", str(recipe), "--visibility", "--unit", FOG)
    assert printed["visibility"] == beside.json()["visibility"]


@pytest.mark.slow
def test_a_campaigns_steps_tell_what_became_of_them(ran: TestClient) -> None:
    plan = ran.get("/api/campaigns/1/plan").json()
    line = plan["timeline"]
    assert {len(values) for values in line.values()} == {plan["steps"]}
    assert (plan["state"], set(line["state"]), plan["datasets"]) == ("done", {"done"}, 15)
    assert line["forecast_s"] == line["started_s"]
    assert line["started_s"] == sorted(line["started_s"])
    store: Store = service_of(ran).store
    bench = service_of(ran).bench
    prepare(store, "short", bench, VirtualClock(), clip=False).bench.close()
    later = ran.get("/api/campaigns/2/plan").json()["timeline"]
    assert set(later["state"]) == {"to come"}
    assert later["forecast_s"] == pytest.approx(later["start_s"])
    assert ran.get("/api/campaigns/3/plan").status_code == 404


def test_what_is_to_come_is_moved_by_what_has_been() -> None:
    def step(state: str, started_s: float | None, ended_s: float | None) -> StepRow:
        return StepRow(0, "rest", {}, 10.0, state, started_s, ended_s, None)

    steps = [
        step("done", 0.0, 25.0), step("skipped", None, None), step("running", 25.0, None), step("planned", None, None),
        step("planned", None, None),
    ]  # fmt: skip
    assert _forecast(steps) == [0.0, 25.0, 25.0, 35.0, 45.0]


def test_a_campaign_is_designed_for_the_bench_of_the_service(client: TestClient) -> None:
    asked = {"like": "ojeda2000", "model": "bias_scale", "u_dps": 0.02}
    answer = client.post("/api/designs", json=asked).json()
    assert answer["is_reached"]
    assert answer["bench"] == "single-axis-sim"
    plan = client.post("/api/plans", json={"recipe": answer["recipe_toml"]}).json()
    assert plan["schedule_hash"] == answer["schedule_hash"]
    assert plan["expected_s"] / 3600 == pytest.approx(answer["chosen"]["hours"])
    assert client.get("/api/campaigns").json() == []
    nothing = client.post("/api/designs", json={"like": "ojeda2000"})
    assert nothing.status_code == 422
    assert "neither u_dps (deg/s) nor hours (h) is given" in nothing.text
