"""Names that outsiders rely on stay: commands, options, HTTP paths, parameters and JSON keys of contract.json.

A name may be added without an entry there. An entry that is missing in the program was renamed or removed.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from labctl.api import create_app
from tests.helpers.certifying import OVERRIDE_OPTIONS
from tests.helpers.contract_names import command_names, has_key, route_names
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES

FACTS: dict[str, Any] = json.loads((Path(__file__).parent / "contract.json").read_text(encoding="utf-8"))
FOG = "OSU-FOG-2024"


def test_every_command_and_option_is_there() -> None:
    found = command_names()
    missing = {
        command: sorted(set(names.split()) - found.get(command, set()))
        for command, names in FACTS["commands"].items()
        if not set(names.split()) <= found.get(command, set())
    }
    assert not missing


def test_every_path_parameter_and_key_of_the_api_is_there() -> None:
    found = route_names(create_app(None))  # the description needs no service
    missing = {
        f"{route} {part}": sorted(set(names.split()) - found.get(route, {}).get(part, set()))
        for route, parts in FACTS["routes"].items()
        for part, names in parts.items()
        if route not in found or not set(names.split()) <= found[route][part]
    }
    assert not missing


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return what the main commands print with --json, by their words."""
    lab = Lab(tmp_path_factory.mktemp("contract"))
    out, file = str(lab.folder / "short"), str(lab.folder / "fog.json")
    reported = {"import": lab.json("import", str(EXAMPLES / "osu-fog"))}
    reported["fit"] = lab.json("fit", FOG, "--effects", "bias,scale_factor,bias_temperature:1")
    reported["criticise"] = lab.json("criticise", FOG)
    reported["improve"] = lab.json("improve", FOG, "--add", "scale_factor_asymmetry")
    reported["ladder"] = lab.json("ladder", FOG)
    reported["certify"] = lab.json("certify", FOG, "2", "--by", "A", *OVERRIDE_OPTIONS)
    reported["certifications"] = lab.json("certifications", FOG)
    reported["calibration"] = lab.json("calibration", FOG)
    reported["revoke"] = lab.json("revoke", FOG, "2", "--by", "A", "--reason", "dropped")
    lab.run("import", str(EXAMPLES / "weiss-gyrostar"))
    reported["fit of a table"] = lab.json("fit", "WEISS-ENV05S", "--model", "weiss1995")
    reported["simulate"] = lab.json("simulate", "short", "--out", out, "--hide", "bias=0.7")
    reported["campaign plan"] = lab.json("campaign", "plan", "short")
    reported["campaign start"] = lab.json("campaign", "start", "short")
    reported["campaign status"] = lab.json("campaign", "status")
    reported["campaign list"] = lab.json("campaign", "list")
    reported["effects"] = lab.json("effects")
    reported["bench check"] = lab.json("bench", "check", "single-axis-sim")
    reported["audit list"] = lab.json("audit", "list")
    reported["audit verify"] = lab.json("audit", "verify")
    reported["backup"] = lab.json("backup", str(lab.folder / "copy.sqlite"))
    reported["check"] = lab.json("check")
    reported["key create"] = lab.json("key", "create", "Ada", "--role", "viewer")
    reported["key list"] = lab.json("key", "list")
    lab.run("calibration", FOG, "--version", "1", "--out", file)
    raw = lab.folder / "raw.csv"
    raw.write_text("gyro_z,temperature_c\n-1.4,40\n", encoding="utf-8")
    reported["compensate"] = lab.json("compensate", file, str(raw), str(lab.folder / "out.csv"))
    return reported


@pytest.mark.parametrize("command", FACTS["answers"])
def test_the_keys_of_an_answer_are_there(answers: dict[str, Any], command: str) -> None:
    missing = [path for path in FACTS["answers"][command].split() if not has_key(answers[command], path)]
    assert not missing, answers[command]


@pytest.mark.parametrize(
    ("path", "there"),
    [("a", True), ("b", False), ("a.*.c", True), ("a.*.d", False), ("e[].f", True), ("e[].g", False), ("h[].f", False)],
)
def test_a_missing_key_is_seen(path: str, there: bool) -> None:
    assert has_key({"a": {"x": {"c": 1}}, "e": [{"f": 1}, {"f": 2}], "h": []}, path) is there
