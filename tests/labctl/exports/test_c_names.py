"""C headers of units whose serial numbers look alike go into one program, and each corrects its own unit."""

from __future__ import annotations

import itertools
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.exports import export_calibration
from labctl.exports.c_header import c_header, c_name
from tests.helpers.calibrations import calibrated
from tests.helpers.recordings import points

ALIKE = (
    "A-1",
    "A_1",
    "A 1",
    "a-1",
    "A.1",
    "A+1",
    "A#1",
    "A1",
    "A-_1",
    "A_-1",
    "A_2d1",
    "A-1_c",
    "A-1_5fc",
    "A--1",
    "1",
)
SUFFIXES = ("_AXES", "_NODES", "_b", "_c", "_correct", "_hash", "_held", "_held_c", "_inside_c", "_k", "_k_squared")
SUFFIXES += ("_node_c", "_output_dps", "_temperature_c")
MAIN = """
#include <stdio.h>
{includes}
int main(void) {{
    double in = 10.0, out;
{calls}
    return 0;
}}
"""


def of_unit(serial: str, gain: float, model: str | None = None) -> Calibration:
    """Return the calibration of a unit whose output is `gain` times the rate."""
    rate, warm = (grid.ravel() for grid in np.meshgrid(np.linspace(-100, 100, 11), np.linspace(0, 50, 11)))
    effects = None if model else ["bias", "scale_factor"]
    return calibrated(points(rate, warm, gain * rate, serial=serial), model, effects)


def guard_of(header: bytes) -> str:
    first, second = (line for line in header.decode().splitlines() if "LABCTL_gyro" in line)
    assert (first.split()[0], second.split()[0]) == ("#ifndef", "#define")
    assert first.split()[1] == second.split()[1]
    return first.split()[1]


def test_no_name_of_one_unit_is_anothers() -> None:
    names = [c_name(serial) + suffix for serial in ALIKE for suffix in SUFFIXES]
    assert len(set(names)) == len(names)
    assert all(name.isidentifier() and name.isascii() for name in names)
    assert (c_name("A-1"), c_name("A_1"), c_name("a1")) == ("gyro_A_2d1", "gyro_A_5f1", "gyro_a1")


def test_the_guard_knows_unit_version_and_content() -> None:
    made = [of_unit(serial, 1.01) for serial in ALIKE[:4]]
    guards = [guard_of(export_calibration(each.to_bytes(), "c")[0]) for each in made]
    assert len(set(guards)) == 4
    assert guards[0] == f"LABCTL_gyro_A_2d1_V1_{made[0].hash[:16]}_H"
    again = of_unit("A-1", 1.02)
    assert again.version == made[0].version
    assert guard_of(export_calibration(again.to_bytes(), "c")[0]) != guards[0]


def test_no_word_of_a_calibration_ends_the_comment() -> None:
    document = {**of_unit("A-1", 1.01).document, "serial": "A**//\n#error */\\"}
    text = export_calibration_of(document)
    comment = text[: text.index("*/")]
    assert "Define LABCTL_REAL" in comment
    assert "\n#error" not in comment
    assert "\\" not in comment


def export_calibration_of(document: dict[str, object]) -> str:
    return c_header(Calibration(document)).decode()


@pytest.mark.slow
@pytest.mark.needs_cc
@pytest.mark.parametrize("model", [None, "ojeda2000"])
def test_one_program_includes_them_all_and_uses_the_right_one(tmp_path: Path, model: str | None) -> None:
    made = {serial: of_unit(serial, 1.0 + 0.01 * index, model) for index, serial in enumerate(ALIKE, start=1)}
    compiler = shutil.which("cc")
    assert compiler is not None
    for index, calibration in enumerate(made.values()):
        (tmp_path / f"unit{index}.h").write_bytes(export_calibration(calibration.to_bytes(), "c")[0])
    order = [*range(len(made)), *range(len(made))]  # a second inclusion changes nothing
    call = '    if ({name}_correct(&in, 25.0, &out)) return 1;\n    printf("%.12f %s\\n", out, {name}_hash);'
    source = MAIN.format(
        includes="\n".join(f'#include "unit{index}.h"' for index in order),
        calls="\n".join(call.format(name=c_name(serial)) for serial in made),
    )
    (tmp_path / "main.c").write_text(source)
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "main.c", "-o", "main", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    said = subprocess.run([tmp_path / "main"], text=True, check=True, capture_output=True).stdout.splitlines()
    rates = [float(line.split()[0]) for line in said]
    expected = [float(Compensator(each).compensate(np.array([10.0]), 25.0).rate_dps[0]) for each in made.values()]
    assert rates == pytest.approx(expected, abs=1e-9)
    assert [line.split()[1] for line in said] == [each.hash for each in made.values()]
    assert min(abs(a - b) for a, b in itertools.combinations(rates, 2)) > 0.01
