"""`labctl inspect` and `--leave-out`: a log with faults, inspected, imported without them, and inspected again."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.recording import read_recording
from labctl.services.recordings.examination import inspection_of_file
from labctl.services.recordings.importers import as_interchange
from labctl.services.recordings.time_order import refuse_unknown
from tests.helpers.forked_commands import run_labctl


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log of 200 s at rest: two spikes, ten readings of a dead thermometer, and two rows exchanged."""
    rng, n = np.random.default_rng(1), 2000
    output, warm = 0.3 + 0.05 * rng.normal(size=n), 25 + 0.01 * rng.normal(size=n)
    output[[100, 700]] += 5.0
    warm[1000:1010] = -127.0
    order = np.arange(n)
    order[[50, 51]] = order[[51, 50]]
    lines = [f"{0.1 * k:.2f},{output[k]:.6f},{warm[k]:.3f}" for k in order]
    path = tmp_path / "rest.csv"
    path.write_text("\n".join(["time_s,gyro_z_dps,temperature_c", *lines]) + "\n")
    return path


def kinds(path: Path) -> dict[str, int | None]:
    return {each.what: each.n for each in inspection_of_file(path).warnings}


def test_an_inspection_finds_every_fault_and_stores_nothing(log: Path) -> None:
    answer = inspection_of_file(log)
    assert kinds(log) == {"time_back": 1, "thermometer": 10, "spikes": 2}
    assert answer.left_out == []
    assert answer.picture is not None
    assert {each["channel"] for each in answer.courses} == {"gyro_z", "temperature_c"}


def test_what_is_left_out_is_stated(log: Path, tmp_path: Path) -> None:
    wanted = ["time_back", "thermometer", "spikes"]
    with as_interchange(log, leave_out=wanted) as folder:
        made = read_recording(folder)
        assert {each.what: each.n for each in made.info.left_out} == {"time_back": 1, "thermometer": 10, "spikes": 2}
        assert int(np.sum(np.asarray(made.columns["valid"]) == 0)) == 12
        assert kinds(folder) == {}


def test_the_commands_print_the_findings(log: Path, tmp_path: Path) -> None:
    database = str(tmp_path / "labctl.db")
    picture = tmp_path / "picture.html"
    said = run_labctl(["inspect", str(log), "--picture", str(picture)])
    assert said.returncode == 0, said.stderr
    assert "-127 deg C" in said.stdout
    assert "labctl import" in said.stdout
    assert "1,999 readings" in picture.read_text()
    refused = run_labctl(["import", str(log), "--accept-map", "--database", database])
    assert refused.returncode != 0
    options = [word for kind in ("time_back", "thermometer", "spikes") for word in ("--leave-out", kind)]
    imported = run_labctl(["import", str(log), "--accept-map", *options, "--database", database])
    assert imported.returncode == 0, imported.stderr
    assert "left out: 10 of 1999 readings of temperature_c" in imported.stdout
    again = run_labctl(["inspect", "1", "--json", "--database", database])
    answer = json.loads(again.stdout)
    assert answer["warnings"] == []
    assert [each["what"] for each in answer["left_out"]] == ["time_back", "thermometer", "spikes"]


def test_a_kind_that_cannot_be_left_out_is_refused() -> None:
    with pytest.raises(BadInput, match="--leave-out copied: readings of this kind cannot be left out; choose from"):
        refuse_unknown(["spikes", "copied"])
