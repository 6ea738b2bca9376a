"""Files of the past: calibrations correct as they did, recipes and benches give the same plans, recordings come in."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.store import open_store
from tests.helpers.corpus import ENTRIES, FOLDER, SAME, SERIAL, Entry, all_changes, migrated, wrongly_named
from tests.helpers.lab import Lab

of_each_entry = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
PLANS = [(entry, recipe) for entry in ENTRIES for recipe in entry.answers["plans"]]


@of_each_entry
def test_its_calibration_file_corrects_the_same_rates_to_the_last_digit(entry: Entry, tmp_path: Path) -> None:
    was = entry.answers["corrected"]
    readings, corrected = tmp_path / "readings.csv", tmp_path / "corrected.csv"
    columns = ["t_s", "gyro_z", "temperature_c"]
    lines = [",".join(str(row[column]) for column in columns) for row in was]
    readings.write_text("\n".join([",".join(columns), *lines]) + "\n", encoding="utf-8")
    Lab(tmp_path).json("compensate", str(entry.folder / "calibration-1.json"), str(readings), str(corrected))
    with corrected.open(newline="", encoding="utf-8") as file:
        now = list(csv.DictReader(file))
    assert [float(row["rate_z_dps"]) for row in now] == [row["rate_z_dps"] for row in was]
    assert [row["outside"] in {"True", "1", "1.0"} for row in now] == [bool(row["outside"]) for row in was]


def bench_of(entry: Entry, name: str) -> Path:
    """Return a bench file as it was then: an entry holds only those that an older one does not hold alike."""
    holders = [each.folder / name for each in ENTRIES if each.name <= entry.name and (each.folder / name).is_file()]
    return holders[-1]


def planned(lab: Lab, entry: Entry, recipe: str) -> dict[str, Any]:
    """Return what a recipe is planned to now, or why it is refused."""
    bench = bench_of(entry, entry.answers["plans"][recipe]["bench_file"])
    said = lab.run("campaign", "plan", str(entry.folder / recipe), "--bench", str(bench), "--json", status=None)
    plan: dict[str, Any] = json.loads(said.stdout) if said.exit_code == 0 else {"refused": said.stderr}
    return plan


@pytest.mark.parametrize(("entry", "recipe"), PLANS, ids=lambda each: getattr(each, "name", each))
def test_its_recipes_and_benches_give_the_same_plans(entry: Entry, recipe: str, tmp_path: Path) -> None:
    was = {key: value for key, value in entry.answers["plans"][recipe].items() if key != "bench_file"}
    assert wrongly_named(entry, f"plans.{recipe}", was, planned(Lab(tmp_path), entry, recipe)) == []


@of_each_entry
def test_its_recording_is_imported_again(entry: Entry, tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    lab.run("import", str(entry.folder / "recording"))
    with open_store(str(lab.database), write=False) as store:
        points = store.recordings.points(1)
    assert points.info.serial == SERIAL
    assert len(points) == entry.answers["plans"]["recipe.toml"]["datasets"]
    (tmp_path / "past").mkdir()
    with open_store(str(migrated(entry.unpack(tmp_path / "past"))), write=False) as store:
        measured = store.recordings.points(1)
    np.testing.assert_allclose(points.gyro_dps("z"), measured.gyro_dps("z"), rtol=SAME)


def test_every_named_change_is_of_entries_and_of_an_answer_that_is_compared() -> None:
    assert ENTRIES, f"no entry in {FOLDER}"
    rows, by_name = all_changes(), {entry.name: entry for entry in ENTRIES}
    for row in rows:
        assert {"entries", "field", "from", "to", "why"} == set(row)
        assert row["why"]
        assert row["entries"]
        for name in row["entries"]:
            assert row["field"].startswith(compared(by_name[name])), f"{name}: no test looks at {row['field']}"
    named = [(name, row["field"]) for row in rows for name in row["entries"]]
    assert sorted(set(named)) == sorted(named), "a field of an entry is named twice"


def compared(entry: Entry) -> tuple[str, ...]:
    """Return how the fields begin that the tests of this folder compare with the answers of an entry."""
    both = [f"{kind}{number}." for kind in ("criticisms.", "calibration-") for number in ("1", "2")]
    others = [f"{name}." for name in ("check", "audit", "verified") if name in entry.answers]
    return (*both, *others, *(f"plans.{recipe}." for recipe in entry.answers["plans"]))
