"""HTTP: several recordings of a unit in a fit, a criticism, its residuals and an improvement."""

from __future__ import annotations

import pytest
from fastapi.testclient import TestClient

from labctl.recording import write_recording
from tests.helpers.joint_recordings import EFFECTS, recordings

UNIT = "/api/units/J-1"


@pytest.fixture
def unit(client: TestClient, tmp_path_factory: pytest.TempPathFactory) -> TestClient:
    """Return a service with two recordings of one unit."""
    for recording in recordings(13).values():
        folder = tmp_path_factory.mktemp("recording") / "it"
        write_recording(recording, folder)
        sent = client.post(
            "/api/recordings", files=[("files", (path.name, path.read_bytes())) for path in folder.iterdir()]
        )
        assert sent.status_code == 201
    return client


@pytest.mark.slow
def test_several_recordings_in_bodies_and_queries(unit: TestClient) -> None:
    fitted = unit.post(f"{UNIT}/calibrations", json={"recordings": [1, 2], "effects": EFFECTS})
    assert fitted.status_code == 201
    assert (fitted.json()["recording"], fitted.json()["recordings"]) == (2, [1, 2])
    version = unit.get(f"{UNIT}/calibrations/1").json()
    assert (version["recordings"], version["joint"]) == ([1, 2], fitted.json()["joint"])
    several = {"recordings": [1, 2]}
    found = unit.get(f"{UNIT}/calibrations/1/criticism", params=several).json()
    assert (found["recording"], found["recordings"], found["joint"]["recordings"]) == (2, [1, 2], [1, 2])
    rows = unit.get(f"{UNIT}/calibrations/1/residuals", params=several).json()["columns"]
    assert rows["recording"] == [1] * 45 + [2] * 45
    assert rows["dataset"] == 2 * list(range(1, 46))
    alone = unit.get(f"{UNIT}/calibrations/1/residuals", params={"recording": 1}).json()["columns"]
    assert (alone["recording"], len(alone["dataset"])) == ([1] * 45, 45)
    changed = unit.post(f"{UNIT}/calibrations/1/improve", json={"add": ["scale_factor_even"], **several})
    assert changed.json()["recordings"] == [1, 2]
    assert unit.get(f"{UNIT}/calibrations/1/assessment").json()["verdict_recording"] == 2


@pytest.mark.slow
def test_a_version_is_compared_with_every_data_set_of_several_recordings(unit: TestClient) -> None:
    unit.post(f"{UNIT}/calibrations", json={"recordings": [1, 2], "effects": EFFECTS})
    path = f"{UNIT}/calibrations/1/comparison"
    both = unit.get(path, params={"recordings": [1, 2]}).json()
    assert (both["recording"], both["recordings"]) == (2, [1, 2])
    assert both["source"] == "version 1 without refitting, on recordings 1 and 2, which the version was fitted to"
    columns = both["columns"]
    assert columns["recording"] == [1] * 45 + [2] * 45
    assert columns["dataset"] == 2 * list(range(1, 46))
    for number in (1, 2):
        alone = unit.get(path, params={"recording": number}).json()["columns"]
        rows = [k for k, of in enumerate(columns["recording"]) if of == number]
        assert alone["recording"] == [number] * 45
        for name in ("measured_error_dps", "modelled_error_dps", "residual_dps"):
            assert [columns[name][k] for k in rows] == pytest.approx(alone[name], abs=1e-12)
    sets = unit.get(f"{UNIT}/calibrations/1/criticism", params={"recordings": [1, 2]}).json()["views"]["sets"]
    assert (sets["recording"], sets["own_dataset"]) == (columns["recording"], columns["dataset"])
    assert sets["dataset"] == list(range(1, 91))


def test_one_recording_and_other_recordings_are_refused_together(unit: TestClient) -> None:
    refused = unit.post(f"{UNIT}/calibrations", json={"recording": 1, "recordings": [1, 2], "effects": EFFECTS})
    assert refused.status_code == 400
    assert "give one of the two" in refused.json()["detail"]
