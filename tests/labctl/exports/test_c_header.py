"""The C header of a calibration: compiled, it computes what the compensator does."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.exports import export_calibration
from tests.helpers.calibrations import inside

MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {{
    double in[{axes}], t; LABCTL_REAL w[{axes}], rate[{axes}]; int a;
    while (scanf("%lf", &t) == 1) {{
        for (a = 0; a < {axes}; a++) {{ if (scanf("%lf", &in[a]) != 1) return 1; w[a] = (LABCTL_REAL)in[a]; }}
        printf("%d", {name}_correct(w, (LABCTL_REAL)t, rate));
        for (a = 0; a < {axes}; a++) printf(" %.17g", (double)rate[a]);
        printf("\\n");
    }}
    return 0;
}}
"""


@pytest.mark.needs_cc
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-11), ("float", 2e-3)])
def test_the_c_header_computes_the_same(
    any_calibration: Calibration, tmp_path: Path, real: str, tolerance: float
) -> None:
    content, media_type = export_calibration(any_calibration.to_bytes(), "c")
    assert media_type == "text/x-c"
    (tmp_path / "calibration.h").write_bytes(content)
    name = next(
        line.split()[1] for line in content.decode().splitlines() if line.endswith(f"_AXES {len(any_calibration.axes)}")
    )
    source = MAIN.format(axes=len(any_calibration.axes), name=name.removesuffix("_AXES"))
    (tmp_path / "main.c").write_text(source)
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [
        compiler,
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        f"-DLABCTL_REAL={real}",
        "-O1",
        "main.c",
        "-o",
        "main",
    ]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    raw, warm = inside(any_calibration, 200)
    warm = np.append(warm, [any_calibration.temperature_c[1] + 50])
    raw = np.vstack([raw, raw[:1]])
    lines = "\n".join(f"{t:.17g} " + " ".join(f"{v:.17g}" for v in row) for t, row in zip(warm, raw, strict=True))
    out = subprocess.run([tmp_path / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    table = np.array([[float(word) for word in line.split()] for line in out.splitlines()])
    expected = Compensator(any_calibration).compensate(raw, warm)
    assert table[:, 1:] == pytest.approx(expected.rate_dps, abs=tolerance)
    assert table[:-1, 0].sum() == 0
    assert table[-1, 0] == 1
