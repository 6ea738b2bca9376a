"""The next experiment: a recipe that settles what the recording could not, once it is run."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from labctl.recording import write_recording
from labctl.services.planning.loading import load_recipe
from procedures.recipe.recipe import Recipe
from tests.helpers.lab import Lab
from tests.helpers.simulated_recordings import three_axes

GRAVITY = {"g_sensitivity": 0.015}


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    made = Lab(tmp_path)
    write_recording(three_axes(5, **GRAVITY), tmp_path / "in", "parquet")
    made.run("import", str(tmp_path / "in"))
    made.run("fit", "STIM-0001", "--model", "yang2018")
    return made


@pytest.mark.slow
def test_gravity_is_told_from_run_and_mounting_by_the_inverted_mounting(lab: Lab) -> None:
    """Yang's three positions, each powered and mounted anew, then each upside down inside one powered run."""
    first = lab.json("criticise", "STIM-0001", "--next", str(lab.folder / "next.toml"))
    assert first["verdict"] == "ambiguous"
    assert {"g_sensitivity", "run_shift", "mounting_shift"} <= set(first["named"])
    best = first["experiments"][0]
    assert "upside down" in best["do"]
    assert {"g_sensitivity", "run_shift"} <= set(best["separates"])
    assert best["power"] > 0.9
    recipe = load_recipe(str(lab.folder / "next.toml"))
    assert recipe == Recipe.model_validate(tomllib.loads((lab.folder / "next.toml").read_text()))
    assert not recipe.mounting.repower_each
    lab.run(
        "simulate", str(lab.folder / "next.toml"), "--bench", "triaxial-sim", "--hide", "g_sensitivity=0.015",
        "--seed", "6", "--out", str(lab.folder / "again"),
    )  # fmt: skip
    lab.run("import", str(lab.folder / "again"))
    lab.run("fit", "STIM-0001", "--model", "single_temperature")
    settled = lab.json("criticise", "STIM-0001")
    assert (settled["verdict"], settled["named"]) == ("missing", ["g_sensitivity"])
