"""HTTP: what the pages ask for, beside what the command line says."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.compensator import Compensator
from labctl.recording import Recording
from labctl.services.criticism import measurements
from labctl.store import Store
from tests.helpers.certifying import OVERRIDE
from tests.helpers.paths import EXAMPLES
from tests.helpers.service import add_recording, service_of

FOG = "/api/units/OSU-FOG-2024"


@pytest.fixture
def fog(client: TestClient, shared_answers: Path) -> TestClient:
    files = [path for path in (EXAMPLES / "osu-fog").iterdir() if path.suffix in {".toml", ".csv"}]
    sent = client.post("/api/recordings", files=[("files", (path.name, path.read_bytes())) for path in files])
    assert sent.status_code == 201
    assert client.post(f"{FOG}/calibrations", json={"model": "ojeda2000"}).status_code == 201
    return client


@pytest.mark.slow
def test_a_version_says_whether_it_is_in_force(fog: TestClient) -> None:
    fitted = fog.post(f"{FOG}/calibrations", json={"model": "ojeda2000"}).json()
    version = fog.get(f"{FOG}/calibrations/2").json()
    assert version | fitted == version
    assert (version["recording"], version["parent"], version["in_force"], version["certification"]) == (
        1, None, False, None,
    )  # fmt: skip
    assert version["created_at"].endswith("Z")
    fog.post(f"{FOG}/calibrations/2/certify", json={"by": "A", "due_days": 365, **OVERRIDE})
    now = fog.get(f"{FOG}/calibrations/2").json()
    assert now["in_force"] is True
    assert now["due"] == now["certification"]["due"] > now["created_at"]
    fog.post(f"{FOG}/calibrations/1/certify", json={"by": "B", "reason": "better"})
    replaced = fog.get(f"{FOG}/calibrations/2").json()
    assert (replaced["in_force"], replaced["due"], replaced["certification"]["by"]) == (False, None, "A")
    assert fog.get(f"{FOG}/calibrations/3").status_code == 404


def test_certifications_are_listed_newest_first(fog: TestClient) -> None:
    assert fog.get(f"{FOG}/certifications").json() == []
    fog.post(f"{FOG}/calibrations/1/certify", json={"by": "A", "reason": "fits", "due_days": 1})
    fog.post(f"{FOG}/calibrations/1/revoke", json={"by": "B", "reason": "dropped"})
    history = fog.get(f"{FOG}/certifications").json()
    assert [(act["version"], act["act"], act["by"], act["reason"]) for act in history] == [
        (1, "revoke", "B", "dropped"), (1, "certify", "A", "fits"),
    ]  # fmt: skip
    assert history[0]["due"] is None
    assert history[1]["due"] > history[1]["at"]
    assert fog.get("/api/units/NO_SERVICE/certifications").status_code == 404


def by_cell(columns: dict[str, list[Any]], *names: str) -> dict[tuple[str, int], tuple[Any, ...]]:
    keys = zip(columns["axis"], columns["dataset"], strict=True)
    return dict(zip(keys, zip(*(columns[name] for name in names), strict=True), strict=True))


@pytest.mark.slow
def test_residuals_are_the_rows_behind_the_map(
    client: TestClient, triaxial: Callable[[int], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    add_recording(client, triaxial(3).campaign(3))
    path = "/api/units/SIM-3/calibrations"
    client.post(path, json={"model": "yang2018"})
    answer = client.get(f"{path}/1/residuals").json()
    rows = answer["columns"]
    assert {len(values) for values in rows.values()} == {3 * 630}
    with monkeypatch.context() as patched:  # one work gives both
        patched.setattr(measurements, "_reduced_readings", None)
        maps = client.get(f"{path}/1/criticism").json()["maps"]
    cells = by_cell(rows, "residual_dps", "over_floor", "table_rate_dps", "temperature_c", "position")
    for part in maps:
        for k, number in enumerate(part["dataset"]):
            names = ("residual_dps", "over_floor", "table_rate_dps", "temperature_c")
            assert cells[part["axis"], number] == (*(part[name][k] for name in names), part["position"])
    measured, modelled = np.array(rows["measured_error_dps"]), np.array(rows["modelled_error_dps"])
    assert measured - modelled == pytest.approx(np.array(rows["residual_dps"]))
    assert np.array(rows["over_floor"]) * np.array(rows["floor_dps"]) == pytest.approx(np.array(rows["residual_dps"]))
    across = np.array(rows["axis"]) != np.array(rows["position"])
    assert not np.any(np.array(rows["own_rate_dps"])[across])
    assert np.array(rows["own_rate_dps"])[~across] == pytest.approx(np.array(rows["table_rate_dps"])[~across])
    assert set(rows["n"]) == {600}
    assert client.get(f"{path}/2/residuals").status_code == 404


def test_too_little_for_a_verdict_still_has_rows(client: TestClient, make_points: Callable[..., Recording]) -> None:
    rate = np.array([-20.0, -10.0, 0.0, 10.0, 20.0])
    add_recording(client, make_points(rate, np.full(5, 25.0), 1.01 * rate + 0.1))
    client.post("/api/units/ONE/calibrations", json={"effects": ["bias", "scale_factor"]})
    assert client.get("/api/units/ONE/calibrations/1/criticism").json()["verdict"] == "insufficient_data"
    rows = client.get("/api/units/ONE/calibrations/1/residuals").json()["columns"]
    assert rows["measured_error_dps"] == pytest.approx(list(0.01 * rate + 0.1))
    assert rows["residual_dps"] == pytest.approx([0.0] * 5, abs=1e-9)
    assert rows["n"] == [None] * 5


@pytest.mark.slow
def test_a_preview_is_what_improve_makes_and_changes_nothing(
    client: TestClient, make_points: Callable[..., Recording], grid_11_by_11: tuple[np.ndarray, np.ndarray]
) -> None:
    rate, warm = grid_11_by_11
    noise = np.random.default_rng(1).normal(0, 0.001, len(rate))
    add_recording(client, make_points(rate, warm, 1.01 * rate + 0.002 * np.abs(rate) + 0.1 + noise))
    unit = "/api/units/ONE/calibrations"
    client.post(unit, json={"effects": ["bias", "scale_factor"]})
    path, change = f"{unit}/1", {"add": ["scale_factor_asymmetry"]}
    store: Store = service_of(client).store
    before = store.audit.rows()
    preview = client.post(f"{path}/preview", json=change)
    assert preview.status_code == 200, preview.text
    assert store.audit.rows() == before
    assert client.get("/api/units/ONE").json()["calibrations"] == [1]
    seen = preview.json()
    made = client.post(f"{path}/improve", json=change).json()
    for name in ("model", "axes", "error", "before", "validity", "plausible", "left_out", "recording", "improved_from"):
        assert seen[name] == made[name], name
    assert seen["residuals"] == client.get(f"{unit}/2/residuals").json()["columns"]
    assert client.post(f"{path}/preview", json={}).status_code == 400
    other = {"add": ["scale_factor_odd"]}  # what is missing stays missing, and is no noise
    seen = client.post(f"{path}/preview", json=other).json()["residuals"]
    client.post(f"{path}/improve", json=other)
    kept = client.get(f"{unit}/3/residuals").json()["columns"]
    for name in ("residual_dps", "floor_dps"):
        assert seen[name] == pytest.approx(kept[name], rel=0.02, abs=1e-6), name
    assert client.post(f"{path}/preview", json={"add": ["no_such"]}).json()["type"] == "urn:labctl:problem:bad-input"


@pytest.mark.slow
def test_recordings_and_their_data_sets(fog: TestClient) -> None:
    ran = fog.post("/api/campaigns", json={"recipe": "short"}).json()
    followed = fog.get(f"/api/campaigns/{ran['id']}/events")
    assert "campaign done" in followed.text
    rows = fog.get("/api/recordings").json()
    assert [(row["id"], row["serial"], row["kind"], row["campaign"], row["datasets"]) for row in rows] == [
        (2, "FOG-0001", "samples", 1, 15), (1, "OSU-FOG-2024", "points", None, 695),
    ]  # fmt: skip
    assert rows[0]["readings"] == 1500
    sets = fog.get("/api/recordings/2/datasets").json()
    columns = {name: values for name, values in sets.items() if isinstance(values, list)}
    assert {len(values) for values in columns.values()} == {15}
    assert sets["state"] == ["complete"] * 15
    assert sets["number"] == list(range(1, 16))
    assert all(begin < end for begin, end in zip(sets["t_from_s"], sets["t_until_s"], strict=True))
    points = fog.get("/api/recordings/2").json()["points"]
    assert sets["channels"]["gyro_z"]["mean"] == points["gyro_z"]
    assert sets["channels"]["gyro_z"]["std"] == points["gyro_z_std"]
    imported = fog.get("/api/recordings/1/datasets").json()
    points = fog.get("/api/recordings/1").json()["points"]
    assert imported["channels"]["gyro_z"]["mean"] == points["gyro_z"]
    assert imported["table_rate_dps"] == points["table_rate_dps"]
    assert fog.get("/api/recordings/3/datasets").status_code == 404


@pytest.mark.slow
def test_a_surface_is_what_the_calibration_takes_off(client: TestClient, triaxial: Callable[[int], Any]) -> None:
    add_recording(client, triaxial(3).campaign(3))
    path = "/api/units/SIM-3/calibrations"
    client.post(path, json={"model": "yang2018"})
    answer = client.get(f"{path}/1/surface", params={"rate_points": 9, "temperature_points": 5}).json()
    assert set(answer["axes"]) == {"x", "y", "z"}
    assert (answer["held"], answer["left_out"]) == ({}, [])
    surface = answer["axes"]["y"]
    low, high = answer["validity"]["temperature_c"]
    assert surface["temperature_c"] == pytest.approx(list(np.linspace(low, high, 5)))
    assert np.array(surface["error_dps"]).shape == (5, 9)
    rows = client.get(f"{path}/1/residuals").json()["columns"]
    modelled = by_cell(rows, "modelled_error_dps", "own_rate_dps", "temperature_c", "position")
    fine = client.get(f"{path}/1/surface", params={"rate_points": 81, "temperature_points": 181}).json()["axes"]["y"]
    for (axis, _), (error, rate, warm, position) in modelled.items():
        if axis == position == "y":
            row = int(np.argmin(np.abs(np.array(fine["temperature_c"]) - warm)))
            line = np.interp(rate, fine["rate_dps"], fine["error_dps"][row])
            assert line == pytest.approx(error, abs=0.01)
    assert client.get(f"{path}/1/surface", params={"rate_points": 1}).status_code == 422
    assert client.get(f"{path}/2/surface").status_code == 404


def test_a_law_of_the_output_has_its_error_at_true_rates(fog: TestClient) -> None:
    answer = fog.get(f"{FOG}/calibrations/1/surface").json()  # ojeda2000 subtracts a function of the output
    surface = answer["axes"]["z"]
    compensator = Compensator.from_bytes(fog.get(f"{FOG}/calibration", params={"version": 1}).content)
    rate = np.array(surface["rate_dps"])
    for warm, errors in zip(surface["temperature_c"], surface["error_dps"], strict=True):
        corrected = compensator.compensate((rate + np.array(errors))[:, None], np.full(len(rate), warm)).rate_dps
        assert corrected[:, 0] == pytest.approx(rate, abs=1e-9)


@pytest.mark.slow
def test_pictures_are_figures_with_how_to_read_them(
    client: TestClient, make_points: Callable[..., Recording], grid_11_by_11: tuple[np.ndarray, np.ndarray]
) -> None:
    rate, warm = grid_11_by_11
    noise = np.random.default_rng(1).normal(0, 0.001, len(rate))
    add_recording(client, make_points(rate, warm, 1.01 * rate + 0.002 * np.abs(rate) + noise))
    client.post("/api/units/ONE/calibrations", json={"effects": ["bias", "scale_factor"]})
    pictures = client.get("/api/units/ONE/calibrations/1/pictures").json()
    found = {picture["id"]: picture for picture in pictures}
    assert {"map", "ladder"} <= set(found)
    assert found["map"]["how_to_read"].startswith("Each cell shows")
    assert {"data", "layout"} <= set(found["map"]["figure"])
    assert found["map"]["figure"]["data"][0]["type"] == "heatmap"


@pytest.mark.slow
def test_the_text_of_the_api_needs_nothing_from_outside(client: TestClient) -> None:
    page = client.get("/api-docs")
    assert page.status_code == 200
    linked = re.findall(r'(?:href|src)="([^"]+)"', page.text)
    assert len(linked) == 5
    for address in linked:
        assert "//" not in address
        found = client.get(f"/{address}")
        assert found.status_code == 200, address
        assert found.content
    assert "://" not in client.get("/api-docs/start.js").text
    assert client.get("/api-docs/core.py").status_code == 404
    for outside in ("/docs", "/redoc"):
        assert client.get(outside).status_code == 404
