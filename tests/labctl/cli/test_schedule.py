"""The schedule on the command line, without a service: entries are kept, and a note says that no service begins
them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from labctl.cli.app import app

RECIPE = """
format = "labctl-recipe/1"
name = "one"
temperatures_c = [25]
rates_dps = [10]
positions = ["z"]
[soak]
hold_s = 60
[acquire]
duration_s = 10
"""


class Lab:
    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def run(self, *arguments: str, status: int = 0) -> Any:
        result = CliRunner().invoke(app, [*arguments, "--database", str(self.folder / "lab.sqlite")])
        assert result.exit_code == status, result.output + result.stderr + repr(result.exception)
        return result

    def json(self, *arguments: str) -> Any:
        return json.loads(self.run(*arguments, "--json").stdout)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


def test_an_entry_is_kept_and_it_is_said_that_nobody_begins_it(lab: Lab) -> None:
    recipe = lab.folder / "one.toml"
    recipe.write_text(RECIPE)
    made = lab.json("campaign", "start", str(recipe), "--bench", "single-axis-sim", "--at", "2199-07-01T08:00")
    assert (made["recipe"], made["bench"], made["state"]) == ("one", "single-axis-sim", "waiting")
    assert "no service runs" in made["note"]
    assert "no time zone was given" in made["note"]
    recipe.unlink()
    cron = ["--cron", "30 2 * * MON", "--time-zone", "Europe/Berlin", "--late-limit-s", "3600", "--priority", "2"]
    weekly = lab.json("campaign", "start", "short", *cron)
    assert "local" not in weekly["note"]
    assert (weekly["cron"], weekly["late_limit_s"], weekly["priority"]) == ("30 2 * * MON", 3600, 2)
    assert [entry["id"] for entry in lab.json("campaign", "schedule", "list")] == [2, 1]
    listed = lab.run("campaign", "schedule", "list")
    assert "30 2 * * MON" in listed.stdout
    assert "no service uses this database" in listed.stderr
    assert lab.json("campaign", "schedule", "cancel", "1")["state"] == "cancelled"
    assert [entry["id"] for entry in lab.json("campaign", "schedule", "list")] == [2]
    assert lab.json("campaign", "schedule", "show", "1")["due_at"] is None
    assert "Europe/Berlin" in lab.run("campaign", "schedule", "show", "2").stdout
    assert lab.json("campaign", "list") == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--at", "2020-01-01T00:00Z"], "is in the past"),
        (["--at", "soon"], "'soon' cannot be read"),
        (["--at", "now", "--cron", "0 2 * * *"], "either a time or a cron line"),
        (["--cron", "0 2 * *"], "4 fields"),
        (["--at", "now", "--time-zone", "Moon/Sea"], "'Moon/Sea' is not known"),
        (["--priority", "3"], "only a scheduled start has this option"),
        (["--at", "now", "--priority", "1000"], "--priority 1000"),
        (["--at", "now", "--late-limit-s", "-1"], "--late-limit-s -1"),
        (["--at", "now", "--speed", "5"], "--speed 5"),
        (["--at", "now", "--bench", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_what_is_wrong_gets_one_clear_line(lab: Lab, options: list[str], said: str) -> None:
    result = lab.run("campaign", "start", "short", *options, status=2)
    assert said in result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    assert lab.json("campaign", "schedule", "list", "--all") == []


def test_an_entry_that_is_not_there_is_named(lab: Lab) -> None:
    for act in ("show", "cancel"):
        assert "scheduled start 7 is not in this database" in lab.run("campaign", "schedule", act, "7", status=2).stderr
