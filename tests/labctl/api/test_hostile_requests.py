"""Uploads and bodies with wrong content are refused in one line: never 500, and nothing of them is kept."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from tests.helpers.hostile_recordings import HOSTILE, with_column, with_datasets
from tests.helpers.lab import Lab
from tests.helpers.service import open_client

DEEP = 100_000
LONGEST_LINE = 600


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with open_client(tmp_path_factory.mktemp("hostile") / "lab.sqlite") as opened:
        yield opened


@pytest.mark.parametrize("case", HOSTILE)
def test_an_upload_is_refused_in_one_line(client: TestClient, tmp_path: Path, case: str) -> None:
    write, said = HOSTILE[case]
    write(tmp_path)
    files = [("files", (path.name, path.read_bytes())) for path in tmp_path.iterdir()]
    answer = client.post("/api/recordings", files=files)
    assert answer.status_code == 400, answer.text
    problem = answer.json()
    assert problem["type"] == "urn:labctl:problem:bad-recording"
    assert re.search(said, problem["detail"])
    assert len(problem["detail"]) < LONGEST_LINE
    assert "/" not in problem["detail"].split(":")[0]
    assert client.get("/api/recordings").json() == []


def test_the_command_line_says_the_same(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    for index, (write, said) in enumerate(HOSTILE.values()):
        folder = tmp_path / str(index)
        folder.mkdir()
        write(folder)
        found = lab.run("import", str(folder), status=2)
        assert found.stdout == ""
        assert re.search(said, found.stderr), found.stderr
        assert found.stderr.count("\n") == 1


BODIES = {
    "arrays": "[" * DEEP + "]" * DEEP,
    "objects": '{"a":' * DEEP + "1" + "}" * DEEP,
    "a nested value": '{"recipe":' + "[" * DEEP + "]" * DEEP + "}",
    "a nested unknown key": '{"recipe":"short","k":' + "[" * 900 + "]" * 900 + "}",
    "many digits": '{"recipe":"short","clip":' + "1" * 5000 + "}",
    "too large a number": '{"recipe":"short","clip":1e400}',
    "half a character": '{"recipe":"\\ud800"}',
    "a long name": '{"recipe":"' + "x" * 500_000 + '"}',
    "a long key": '{"' + "k" * 500_000 + '":1}',
    "many keys": "{" + ",".join(f'"k{n}":1' for n in range(50_000)) + "}",
    "a nested recipe": '{"recipe":"name=\'x\'\\nk=' + "[" * DEEP + "]" * DEEP + '"}',
    "a dotted recipe": '{"recipe":"\\n[' + "a." * DEEP + 'a]"}',
    "digits in a recipe": '{"recipe":"\\nseed=' + "1" * 5000 + '"}',
}


@pytest.mark.timeout(20)
@pytest.mark.parametrize("path", ["/api/plans", "/api/campaigns", "/api/units/G/calibrations"])
@pytest.mark.parametrize("case", BODIES)
def test_a_body_is_refused_in_one_line(client: TestClient, path: str, case: str) -> None:
    answer = client.post(path, content=BODIES[case].encode(), headers={"Content-Type": "application/json"})
    assert answer.status_code in {400, 422}, answer.text[:1000]
    assert answer.headers["content-type"] == "application/problem+json"
    assert len(answer.json()["detail"]) < LONGEST_LINE
    assert client.get("/api/campaigns").json() == []


def test_what_is_taken_in_is_what_was_sent(client: TestClient, tmp_path: Path) -> None:
    """The largest numbers of data sets stay two."""
    with_datasets(tmp_path, "2147483646", "2147483647")
    files = [("files", (path.name, path.read_bytes())) for path in tmp_path.iterdir()]
    number = client.post("/api/recordings", files=files).json()["recording"]
    assert client.get(f"/api/recordings/{number}/datasets").json()["number"] == [2147483646, 2147483647]


@pytest.mark.parametrize("size", [1e308, 1e200, 1e99, 1e-308, 0.0])
def test_readings_of_any_size_are_no_traceback(tmp_path: Path, size: float) -> None:
    with open_client(tmp_path / "lab.sqlite") as client:
        with_column(tmp_path, "gyro_z", [size, -size, size, -size])
        files = [("files", (name, (tmp_path / name).read_bytes())) for name in ("recording.toml", "samples.parquet")]
        answer = client.post("/api/recordings", files=files)
        if size > 1e100:
            assert answer.status_code == 400
            assert f"column 'gyro_z', row 1: {size:g} is larger than 1e+100" in answer.json()["detail"]
            return
        assert answer.status_code == 201, answer.text
        number = answer.json()["recording"]
        paths = ("", "/datasets", "/trace?channel=gyro_z", "/samples?dataset=1", "/file", "/allan")
        asked = [client.get(f"/api/recordings/{number}{path}") for path in paths]
        assert {each.status_code for each in asked} <= {200, 422}, [each.text[:200] for each in asked]
        fitted = client.post("/api/units/G-1/calibrations", json={"effects": ["bias"]})
        assert fitted.status_code in {201, 422}, fitted.text
        if fitted.status_code == 201:
            assert client.get("/api/units/G-1/calibrations/1/criticism").status_code in {200, 422}
