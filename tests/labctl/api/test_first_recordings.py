"""HTTP: what a newcomer begins with in one press: an example, a simulated recording, a simulated campaign."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import prepare
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.services.recordings.examples import examples
from labctl.services.simulation.hidden_effects import with_hidden_effects
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.service import service_of

HIDE = ["scale_factor_asymmetry=0.02"]
NOISE_UNITS = ["scale_factor_asymmetry=z30"]


def test_examples_come_with_the_package(client: TestClient) -> None:
    assert set(examples()) == {"freeimu-warmup", "imucal-turns", "osu-fog", "weiss-gyrostar"}
    assert all("labctl" in folder.parts[-3:] for folder in examples().values())
    fog = client.post("/api/recordings/example", json={"name": "osu-fog"})
    assert fog.status_code == 201
    assert fog.json().items() >= {"serial": "OSU-FOG-2024", "datasets": 695, "suggested_model": "ojeda2000"}.items()
    table = client.post("/api/recordings/example", json={"name": "weiss-gyrostar"}).json()
    assert table["suggested_model"] == "weiss1995"
    client.post("/api/units/WEISS-ENV05S/calibrations", json={"model": "weiss1995"})
    for view in ("criticism", "residuals", "pictures"):
        nothing = client.get(f"/api/units/WEISS-ENV05S/calibrations/1/{view}")
        assert (nothing.status_code, "table of coefficients" in nothing.json()["detail"]) == (400, True)
    assert client.get("/api/units/WEISS-ENV05S/calibrations/1/surface").status_code == 200
    turned = client.post("/api/recordings/example", json={"name": "imucal-turns"}).json()
    assert turned.items() >= {"serial": "IMUCAL-FERRARIS", "suggested_model": "turns", "warnings": []}.items()
    refused = client.post("/api/recordings/example", json={"name": "../.."})
    known = "choose one of freeimu-warmup, imucal-turns, osu-fog, weiss-gyrostar"
    assert (refused.status_code, known in refused.json()["detail"]) == (
        400,
        True,
    )


def test_a_simulated_recording_is_taken_in_with_what_is_hidden(client: TestClient) -> None:
    asked = {"recipe": "short", "hide": HIDE, "seed": 7, "serial": "HIDDEN-7"}
    made = client.post("/api/recordings/simulated", json=asked)
    assert made.status_code == 201, made.text
    answer = made.json()
    assert answer["hidden"] == {"scale_factor_asymmetry": 0.02}
    assert (answer["serial"], answer["datasets"], answer["seed"], answer["recipe"]) == ("HIDDEN-7", 15, 7, "short")
    (row,) = client.get("/api/recordings").json()
    assert (row["serial"], row["readings"], row["campaign"]) == ("HIDDEN-7", answer["readings"], None)
    assert row["notes"].startswith("simulated")
    assert row["origin"] == client.get("/api/recordings/1").json()["origin"] == "simulation"
    assert "simulated: recipe short, seed 7" in row["notes"]
    store: Store = service_of(client).store
    (act,) = store.audit.rows()
    assert act.action == "simulate"
    assert act.detail.items() >= {"hidden": answer["hidden"], "seed": 7, "serial": "HIDDEN-7"}.items()
    plain = client.post("/api/recordings/simulated", json={**asked, "hide": [], "serial": "PLAIN-7"}).json()
    with_it, without = asymmetry(client, answer["recording"]), asymmetry(client, plain["recording"])
    assert abs(with_it - without) == pytest.approx(0.04, rel=0.1)


def asymmetry(client: TestClient, recording: int) -> float:
    """How much a scale factor differs between the two ways of turning (twice the effect), from the fastest rates."""
    sets = client.get(f"/api/recordings/{recording}/datasets").json()
    rate, gyro = np.array(sets["table_rate_dps"]), np.array(sets["channels"]["gyro_z"]["mean"])
    rest = gyro[np.abs(rate) < 1].mean()
    gain = [np.mean((gyro[np.abs(rate - at) < 1] - rest) / rate[np.abs(rate - at) < 1]) for at in (40.0, -40.0)]
    return float(gain[0] - gain[1])


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ({"recipe": "short", "hide": ["gremlins"]}, "effect 'gremlins' cannot be hidden; choose one of"),
        ({"recipe": "short", "hide": ["scale_factor_asymmetry=much"]}, "is not a finite number"),
        ({"recipe": "/etc/passwd"}, "send the text of a recipe, or one of"),
    ],
)
def test_what_cannot_be_simulated_says_why(client: TestClient, body: dict[str, Any], says: str) -> None:
    answer = client.post("/api/recordings/simulated", json=body)
    assert (answer.status_code, says in answer.json()["detail"]) == (400, True), answer.text
    assert client.get("/api/recordings").json() == []
    assert client.post("/api/recordings/simulated", json={"recipe": "short", "serial": "../x"}).status_code == 422


def run(client: TestClient, **body: Any) -> int:
    """Run the short campaign to its end; returns its recording."""
    number = client.post("/api/campaigns", json={"recipe": "short", **body}).json()["id"]
    assert "campaign done" in client.get(f"/api/campaigns/{number}/events").text
    return int(client.get(f"/api/campaigns/{number}").json()["recordings"]["FOG-0001"])


@pytest.mark.slow
def test_a_simulated_campaign_can_hide_an_effect(client: TestClient) -> None:
    plain, hidden = run(client), run(client, hide=HIDE)
    assert asymmetry(client, hidden) - asymmetry(client, plain) == pytest.approx(0.04, rel=0.1)
    store: Store = service_of(client).store
    assert store.campaigns.get(1).bench["simulation"]["hidden"] == {}
    assert store.campaigns.get(2).bench["simulation"]["hidden"] == {"scale_factor_asymmetry": 0.02}
    starts = [row.detail for row in store.audit.rows() if row.action == "campaign start"]
    assert [detail.get("hidden") for detail in starts] == [None, {"scale_factor_asymmetry": 0.02}]
    later = client.post("/api/campaigns", json={"recipe": "short", "hide": HIDE, "at": "2199-01-01T00:00Z"})
    assert (later.status_code, later.json()["hide"]) == (202, HIDE)
    sized = client.post("/api/campaigns", json={"recipe": "short", "hide": NOISE_UNITS, "at": "2199-01-01T00:00Z"})
    asked = SimulateRequest(recipe="short", bench="single-axis-sim", hide=NOISE_UNITS)
    name, size = next(iter(make_recording(asked).hidden.items()))
    assert (sized.status_code, sized.json()["hide"]) == (202, [f"{name}={size!r}"])  # as `labctl simulate` reads it
    wrong = client.post("/api/campaigns", json={"recipe": "short", "hide": ["gremlins=z3"]})
    assert (wrong.status_code, "cannot be hidden" in wrong.json()["detail"]) == (400, True)
    wrong = client.post("/api/campaigns", json={"recipe": "short", "hide": ["gremlins"]})
    assert (wrong.status_code, "cannot be hidden" in wrong.json()["detail"]) == (400, True)


def test_nothing_is_hidden_in_a_real_unit(tmp_path: Path) -> None:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    runner = BenchRunner(store, load_bench("example-real"), VirtualClock)
    with TestClient(create_app(LabService(store, SystemClock(), runner))) as real:
        for hide in (HIDE, NOISE_UNITS):
            answer = real.post("/api/campaigns", json={"recipe": "short", "hide": hide})
            assert answer.status_code == 400
            assert "is not simulated, and effects can be hidden only in simulated units" in answer.json()["detail"]
        assert real.get("/api/campaigns").json() == []


@pytest.mark.slow
def test_a_resumed_campaign_goes_on_with_the_same_units(tmp_path: Path) -> None:
    store = Store(Database(str(tmp_path / "lab.sqlite"), write=True))
    bench = load_bench("single-axis-sim")
    prepare(
        store, "short", with_hidden_effects(bench, HIDE), VirtualClock(), clip=False
    ).bench.close()  # and the process dies
    with TestClient(create_app(LabService(store, SystemClock(), BenchRunner(store, bench, VirtualClock)))) as again:
        assert "campaign done" in again.get("/api/campaigns/1/events").text
        assert asymmetry(again, 1) - asymmetry(again, run(again)) == pytest.approx(0.04, rel=0.1)


@pytest.mark.slow
def test_what_made_a_recording_is_no_matter_of_its_notes(client: TestClient) -> None:
    made = make_recording(SimulateRequest(recipe="short")).recording
    assert made.info.notes.startswith("simulated")
    store = service_of(client).store
    store.recordings.add_import(made, made.info.started_at)  # as from a folder that was written elsewhere
    plain = replace(made, info=made.info.model_copy(update={"notes": ""}))
    store.recordings.add_import(plain, made.info.started_at, {"recipe": "short"})
    number = client.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    assert "campaign done" in client.get(f"/api/campaigns/{number}/events").text
    origins = {row["id"]: row["origin"] for row in client.get("/api/recordings").json()}
    assert origins == {1: "import", 2: "simulation", 3: "campaign"}
