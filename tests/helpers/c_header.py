"""The C header of a calibration, compiled and run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np

from labctl.calibration import Calibration
from labctl.exports import export_calibration

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


def in_c(calibration: Calibration, raw: np.ndarray, warm: np.ndarray, folder: Path, real: str = "double") -> np.ndarray:
    """Compile a calibration's C header; return flag and rates of samples, (n, 1 + axes)."""
    content, media_type = export_calibration(calibration.to_bytes(), "c")
    assert media_type == "text/x-c"
    (folder / "calibration.h").write_bytes(content)
    name = next(
        line.split()[1] for line in content.decode().splitlines() if line.endswith(f"_AXES {len(calibration.axes)}")
    )
    source = MAIN.format(axes=len(calibration.axes), name=name.removesuffix("_AXES"))
    (folder / "main.c").write_text(source)
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", f"-DLABCTL_REAL={real}", "-O1", "main.c"]
    subprocess.run([*command, "-o", "main", "-lm"], cwd=folder, check=True, capture_output=True)
    lines = "\n".join(f"{t:.17g} " + " ".join(f"{v:.17g}" for v in row) for t, row in zip(warm, raw, strict=True))
    out = subprocess.run([folder / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    return np.array([[float(word) for word in line.split()] for line in out.splitlines()])
