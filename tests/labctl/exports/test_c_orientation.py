"""Static bias and orientation of the C header, compiled: the numbers of Python, reading by reading."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.error_per_turn import static_bias
from labctl.exports import export_calibration
from labctl.orientation import Orientation

MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {
    double t, w, bias[1], u[1]; LABCTL_REAL rate[1]; int still, n = 0, bad; NAME_rest rest; NAME_orientation o;
    NAME_rest_begin(&rest);
    NAME_orientation_begin(&o, 10, 0.05);
    while (scanf("%lf %lf %d", &t, &w, &still) == 3) {
        rate[0] = (LABCTL_REAL)w;
        if (n++ < 150) NAME_rest_add(&rest, rate);
        bad = NAME_orientation_update(&o, t, w, still);
        printf("%d %.17g %.17g %d %.17g\\n", bad, o.angle_deg, o.offset_dps, o.standing, o.gap_s);
    }
    bad = NAME_static_bias(&rest, 0.002, bias, u);
    printf("%d %.17g %.17g 0 0\\n", bad, bias[0], u[0]);
    return 0;
}
"""


def in_c(calibration: Calibration, rows: np.ndarray, folder: Path) -> np.ndarray:
    """Compile a header with every warning an error; return what it says of readings (n, 3), and the static bias."""
    content = export_calibration(calibration.to_bytes(), "c")[0]
    (folder / "calibration.h").write_bytes(content)
    name = next(line.split()[1] for line in content.decode().splitlines() if line.endswith("_AXES 1"))
    (folder / "main.c").write_text(MAIN.replace("NAME", name.removesuffix("_AXES")))
    compiler = shutil.which("cc")
    assert compiler is not None
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror", "-O1"]
    command = [compiler, *strict, "main.c", "-o", "main", "-lm"]
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines = "\n".join(f"{t:.17g} {w:.17g} {int(still)}" for t, w, still in rows)
    out = subprocess.run([folder / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    return np.array([[float(word) for word in line.split()] for line in out.splitlines()])


def drive(seed: int, from_s: float = 0.0) -> np.ndarray:
    """Return readings (n, 3) of a drive: time, rate, and what is known; rests, turns, starts, gaps and a loud rest."""
    rng = np.random.default_rng(seed)
    parts, known = [], []
    for seconds, rate, noise, still in (
        (30, 0, 0.05, -1), (7, 40, 0.05, -1), (45, 0, 0.05, -1), (1, 1.5, 0.05, -1), (9, -25, 0.05, -1),
        (8, 0, 0.9, -1), (6, 0.8, 0.05, 0), (12, 0, 0.05, -1), (5, 0, 0.9, 1), (12, 0, 0.05, 1), (6, 90, 0.05, -1),
        (3, 0, 0.05, -1), (4, 3, 1.2, -1), (20, 0, 0.45, -1),
    ):  # fmt: skip
        n = int(10 * seconds)
        parts.append(rate + 0.3 + noise * rng.standard_normal(n))
        known.append(np.full(n, still))
    w, still = np.concatenate(parts), np.concatenate(known)
    step = rng.uniform(0.05, 0.15, len(w))
    step[[200, 700, 1100]] = 2.5  # longer than a gap
    return np.column_stack([from_s + np.cumsum(step), w, still])


@pytest.mark.needs_cc
def test_c_follows_the_angle_and_the_static_bias_of_python(fog: Calibration, tmp_path: Path) -> None:
    rows = np.vstack([drive(1), drive(2, from_s=400.0), drive(3, from_s=800.0)])
    found = in_c(fog, rows, tmp_path)
    o = Orientation(10.0, 0.05)
    knows = {-1: None, 0: False, 1: True}
    expected = [
        (o.update(t, w, still=knows[int(still)]), o.offset_dps, o.standing, o.gap_s) for t, w, still in rows.tolist()
    ]
    assert 0.2 < np.mean([standing for *_, standing, _ in expected]) < 0.8
    assert len({offset for _, offset, *_ in expected}) > 20
    assert expected[-1][3] > 7.5
    assert found[:-1, 0].sum() == 0
    assert found[:-1, 3].tolist() == [float(standing) for *_, standing, _ in expected]
    assert found[:-1, [1, 2, 4]] == pytest.approx(np.array(expected)[:, [0, 1, 3]], abs=1e-9)
    bias = static_bias(rows[:150, 1], instability_dps=0.002)
    assert found[-1, :3] == pytest.approx([0, bias.bias_dps, bias.u_dps], abs=1e-12)


@pytest.mark.needs_cc
def test_c_refuses_what_python_does(fog: Calibration, tmp_path: Path) -> None:
    rows = np.array([[0, 1, -1], [0, 1, -1], [1, np.nan, -1], [0.1, 1, 0]])
    found = in_c(fog, rows, tmp_path)
    assert found[:-1, 0].tolist() == [0, 1, 1, 0]
    assert found[3, 1] == pytest.approx(10 + (1 - 0.05) * 0.1)
    assert found[-1, 0] == 1
    assert np.isnan(found[-1, 1:3]).all()
