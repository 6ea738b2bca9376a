"""`labctl campaign design`: a recipe file that plans as promised, and what is printed beside it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.helpers.forked_commands import run_labctl

ASKED = ["campaign", "design", "--like", "ojeda2000", "--model", "bias_scale", "--u", "0.02"]


def test_the_file_is_planned_as_promised(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    found = run_labctl([*ASKED, "--out", str(out), "--json"], folder=tmp_path)
    assert found.returncode == 0, found.stderr
    answer = json.loads(found.stdout)
    assert answer["recipe_toml"] == out.read_text(encoding="utf-8")
    plan = json.loads(run_labctl(["campaign", "plan", str(out), "--json"], folder=tmp_path).stdout)
    assert plan["schedule_hash"] == answer["schedule_hash"]
    assert plan["expected_s"] == pytest.approx(3600 * answer["chosen"]["hours"])


def test_a_person_reads_the_reasons_and_what_it_was_compared_with(tmp_path: Path) -> None:
    shown = run_labctl([*ASKED, "--out", "mine.toml", "--temperatures", "25,40"], folder=tmp_path).stdout
    assert "25 to 40 deg C" in shown
    for text in (
        "the shortest recipe found that reaches 0.02 deg/s",
        "ojeda2000",
        "at best",
        "counted with: white noise",
    ):
        assert text in shown


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--rates", "-5"], "--rates '-5' is not two numbers; give LOW,HIGH"),
        (["--temperatures", "-90,20"], "temperatures -90 deg C: outside"),
        (["--hours", "0.01"], "the shortest recipe found takes"),
    ],
)
def test_what_cannot_be_designed_is_one_line_and_writes_no_file(tmp_path: Path, more: list[str], said: str) -> None:
    found = run_labctl([*ASKED, "--out", "mine.toml", *more], folder=tmp_path)
    assert (found.returncode, found.stdout) == (2, "")
    assert said in found.stderr
    assert found.stderr.count("\n") == 1
    assert not (tmp_path / "mine.toml").exists()
