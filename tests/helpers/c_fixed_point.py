"""The Q31 header of a calibration, compiled and run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np

from labctl.calibration import Calibration
from labctl.exports import export_calibration
from labctl.exports.c_header import c_name

STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror"]
MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {{
    int32_t w[{inputs}], rate[{axes}]; int t, a, in;
    while (scanf("%d", &t) == 1) {{
        for (a = 0; a < {inputs}; a++) {{ if (scanf("%d", &in) != 1) return 1; w[a] = in; }}
        printf("%d", {call});
        for (a = 0; a < {axes}; a++) printf(" %d", (int)rate[a]);
        printf("\\n");
    }}
    return 0;
}}
"""


def compiled(folder: Path, calibration: Calibration, rows: np.ndarray, *, with_force: bool = False) -> np.ndarray:
    """Return flag and rates, (n, 1 + axes), of rows of temperature, outputs and, `with_force`, forces."""
    compiler = shutil.which("cc")
    assert compiler is not None
    (folder / "calibration.h").write_bytes(export_calibration(calibration.to_bytes(), "c-q31")[0])
    name, axes = c_name(calibration.serial), len(calibration.axes)
    call = f"{name}_q31_correct_with_force(w, t, w + {axes}, rate)" if with_force else f"{name}_q31_correct(w, t, rate)"
    (folder / "main.c").write_text(MAIN.format(axes=axes, inputs=rows.shape[1] - 1, call=call))
    subprocess.run([compiler, *STRICT, "main.c", "-o", "main"], cwd=folder, check=True, capture_output=True)
    given = "\n".join(" ".join(map(str, row)) for row in rows.tolist())
    said = subprocess.run([folder / "main"], input=given, text=True, check=True, capture_output=True).stdout
    return np.array([[int(word) for word in line.split()] for line in said.splitlines()])
