"""What labctl says of the published files, asked as a user asks: import, fit, criticise on the command line."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from studies.real.independent.files import AXES, PUBLISHED, Found, Value

MAPS = PUBLISHED / "maps"
COEFFICIENTS_OF_TEMPERATURE = {
    "bias": "bias at 20 deg C, deg/s", "bias_t1": "slope at 20 deg C, deg/s/K", "bias_t2": "curvature, deg/s/K2",
}  # fmt: skip


@dataclass(frozen=True)
class Answer:
    """What labctl found: quantities, the error figures of the fit, and what its criticism says is missing."""

    found: Found
    error: Mapping[str, Any]
    verdict: str


class Commands:
    """labctl's command line on a database of its own in a folder."""

    def __init__(self, folder: Path) -> None:
        self._database = folder / "real.sqlite"

    def json(self, *arguments: str, statuses: Sequence[int] = (0,)) -> Any:
        """Return what a command prints with --json."""
        from labctl.cli.app import app  # so that --help of the study needs no labctl

        given = [*arguments, "--json", "--database", str(self._database)]
        done = CliRunner().invoke(app, given)
        if done.exit_code not in statuses:
            raise RuntimeError(f"labctl {' '.join(given)}: exit {done.exit_code}: {done.stderr or done.output}")
        return json.loads(done.stdout)

    def taken(self, name: str, map_name: str, *beside: str) -> str:
        """Import a published file by its map; return the serial number."""
        further = [each for other in beside for each in ("--beside", str(PUBLISHED / other))]
        path, column_map = str(PUBLISHED / name), str(MAPS / f"{map_name}.toml")
        serial: str = self.json("import", path, "--map", column_map, *further)["serial"]
        return serial

    def verdict(self, serial: str) -> str:
        """Return the criticism of a unit's newest version, in its own words without advice."""
        text: list[str] = self.json("criticise", serial, statuses=(0, 1))["text"]
        return " ".join(line for line in text if not line.startswith(("Check", "To tell", "Equivalent")))


def at_rest(commands: Commands, name: str, map_name: str) -> Answer:
    """Return the bias and its dependence on temperature of a unit at rest."""
    serial = commands.taken(name, map_name)
    fit = commands.json("fit", serial, "--model", "bias_temperature")
    assert fit["reference_temperature_c"] == 20.0
    found = {
        f"{axis}: {words}": _value(fit["axes"][axis]["coefficients"][key])
        for axis in AXES
        for key, words in COEFFICIENTS_OF_TEMPERATURE.items()
    }
    found["error at temperatures left out of the fit, deg/s"] = Value(fit["error"]["heldout_rms_dps"])
    return Answer(found, fit["error"], commands.verdict(serial))


def by_turns(commands: Commands, name: str, map_name: str) -> Answer:
    """Return the matrix and bias of a unit turned by hand."""
    serial = commands.taken(name, map_name)
    fit = commands.json("fit", serial, "--model", "turns")
    return Answer(_matrix(fit), fit["error"], commands.verdict(serial))


def in_poses(commands: Commands, name: str, map_name: str, *beside: str) -> Answer:
    """Return the matrix, the bias and the error of gravity's direction after a move, of a unit in poses."""
    serial = commands.taken(name, map_name, *beside)
    fit = commands.json("fit", serial, "--model", "poses")
    moves, held_out = fit["poses"]["moves"], fit["poses"]["held_out"]
    found = _matrix(fit) | {"gravity after a move, off by, deg": Value(moves["residual_deg"])}
    shown = (
        f"{moves['used']} of {moves['count']} moves used; held out {held_out['rms_deg']:.3f} deg; no criticism of poses"
    )
    return Answer(found, fit["error"], shown)


def on_rate_table(commands: Commands, name: str, map_name: str) -> Answer:
    """Return bias, scale factor and sine of the fibre-optic gyro, and the errors of three models."""
    serial = commands.taken(name, map_name)
    direct = commands.json("fit", serial, "--model", "ojeda2000")["error"]
    straight = commands.json("fit", serial, "--model", "bias_scale")
    sine = commands.json("improve", serial, "--add", "sine_response")
    assert sine["reference_temperature_c"] == 43.0
    known = {key: _value(entry) for key, entry in sine["axes"]["z"]["coefficients"].items()}
    found = {
        "bias at 43 deg C, deg/s": known["bias"],
        "scale factor at 43 deg C, 1e-3": _times(1e3, known["scale_factor"]),
        "scale factor, slope at 43 deg C, 1e-6/K": _times(1e6, known["scale_factor_t1"]),
        "sine, k, rad/(rad/s)": known["k"],
        "error of bias and scale factor, deg/s": Value(straight["error"]["rms_dps"]),
        "error with the sine, deg/s": Value(sine["error"]["rms_dps"]),
        "error with the sine at temperatures left out of the fit, deg/s": Value(sine["error"]["heldout_rms_dps"]),
        "error of twelve coefficients in the output, deg/s": Value(direct["rms_dps"]),
    }
    return Answer(found, sine["error"], commands.verdict(serial))


def _value(entry: Mapping[str, Any]) -> Value:
    value, u = (entry[key][0] if isinstance(entry[key], list) else entry[key] for key in ("value", "u"))
    return Value(float(value), math.nan if u is None else float(u))


def _times(factor: float, value: Value) -> Value:
    return Value(factor * value.value, factor * value.u)


def _matrix(fit: Mapping[str, Any]) -> Found:
    found: Found = {}
    for axis in AXES:
        coefficients = fit["axes"][axis]["coefficients"]
        for about in AXES:
            key = "scale_factor" if axis == about else f"misalignment_{about}"
            found[f"{axis} by rate about {about}, E, 1e-3"] = _times(1e3, _value(coefficients[key]))
        found[f"{axis}: bias, deg/s"] = _value(coefficients["bias"])
    return found
