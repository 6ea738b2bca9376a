"""Damaged logs over HTTP: a recording, or one problem document that names the file; never a failure of the service."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fastapi.testclient import TestClient

from studies.damaged_logs import DamagedLog, damaged_logs, rows, sent_as, whole_logs
from studies.hostile_logs import KINDS as CRAFTED
from studies.hostile_logs import hostile_logs

LOGS, PREVIEW = "/api/recordings/logs", "/api/recordings/logs/preview"
SEED, OF_EACH = 29, 12


@pytest.mark.slow
def test_whole_logs_of_every_kind_are_imported(client: TestClient, tmp_path: Path) -> None:
    whole = whole_logs(tmp_path)
    logs = {kind: sent_as(kind, whole, "", content) for kind, content in whole.items()}
    for kind, log in logs.items():
        made = client.post(log.path, **log.parts)
        assert made.status_code == 201, (kind, made.text)


@pytest.mark.slow
def test_a_damaged_log_is_imported_or_refused_by_its_name(client: TestClient, tmp_path: Path) -> None:
    counted: Counter[int] = Counter()
    for log in damaged_logs(whole_logs(tmp_path), OF_EACH, SEED):
        for path in dict.fromkeys((PREVIEW if log.path == LOGS else log.path, log.path)):
            answer = client.post(path, **log.parts)
            said = answer.text[:300]
            assert answer.status_code in {200, 201, 400, 409, 422}, (log.kind, log.damage, answer.status_code, said)
            if answer.status_code == 400:
                assert is_named(log, answer.json()["detail"]), (log.kind, log.damage, said)
            counted[answer.status_code] += 1
    assert counted[400] > OF_EACH, counted
    assert counted[201] > OF_EACH // 2, counted  # a flipped bit of a reading is another reading


def is_named(log: DamagedLog, detail: str) -> bool:
    """Return whether a refusal begins with the file that is wrong, one of a recording or the map of a log."""
    return detail.startswith((log.name, *log.beside, "map"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in CRAFTED if kind != "bomb"])  # a bomb needs the limit of a worker
def test_a_crafted_file_is_imported_or_refused_by_its_name(client: TestClient, tmp_path: Path, kind: str) -> None:
    for log in hostile_logs(tmp_path, kinds={kind}):
        answer = client.post(log.path, **log.parts)
        assert answer.status_code in {201, 400, 409, 413, 422}, (log.damage, answer.status_code, answer.text[:300])
        if answer.status_code == 400:
            assert is_named(log, answer.json()["detail"]), (log.damage, answer.text[:300])


def with_booleans(path: Path) -> bytes:
    """Return a Parquet file whose column gyro_x is true and false."""
    t_s, x, y, z, _ = rows().T
    columns = {"time [s]": t_s, "gyro_x [rad/s]": x > 0, "gyro_y [rad/s]": y, "gyro_z [rad/s]": z}
    pq.write_table(pa.table(columns), path)
    return path.read_bytes()


def test_a_boolean_column_is_no_gyro(client: TestClient, tmp_path: Path) -> None:
    sent = {"file": ("log.parquet", with_booleans(tmp_path / "log.parquet"))}
    seen = client.post(PREVIEW, files=sent).json()
    assert sorted(seen["column_map"]["columns"]) == ["gyro_y", "gyro_z", "t_s"]
    assert seen["problems"] == []
    assert seen["unused"] == ["gyro_x [rad/s]"]


@pytest.mark.parametrize("target", ["gyro_x", "t_s", "temperature_c", "position", "table_rate_dps"])
def test_a_boolean_column_that_a_map_names_is_one_problem(client: TestClient, tmp_path: Path, target: str) -> None:
    sent = {"file": ("log.parquet", with_booleans(tmp_path / "log.parquet"))}
    named = {
        "t_s": '{from = "time [s]", unit = "s"}',
        "gyro_y": '{from = "gyro_y [rad/s]", unit = "rad/s"}',
        target: '{from = "gyro_x [rad/s]"}',
    }
    column_map = "\n".join(["[columns]", *(f"{name} = {value}" for name, value in named.items())])
    refused = client.post(LOGS, files=sent, data={"column_map": column_map})
    assert refused.status_code == 400
    said = f"column 'gyro_x [rad/s]' (for {target}) holds true and false; expected readings; "
    assert refused.json()["problems"] == [said + "name another column in the map, or leave this one out"]
