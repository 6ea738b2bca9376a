"""The C header of a calibration, compiled and run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np

from labctl.calibration import Calibration
from labctl.exports import export_calibration

STRICT = ("-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror")
MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {{
    {begin}
    double in[{inputs}], t; LABCTL_REAL w[{inputs}], rate[{axes}]; int a;
    while (scanf("%lf", &t) == 1) {{
        for (a = 0; a < {inputs}; a++) {{ if (scanf("%lf", &in[a]) != 1) return 1; w[a] = (LABCTL_REAL)in[a]; }}
        printf("%d", {call});
        for (a = 0; a < {axes}; a++) printf(" %.17g", (double)rate[a]);
        printf("\\n");
    }}
    return 0;
}}
"""


def in_c(
    calibration: Calibration, raw: np.ndarray, warm: np.ndarray, folder: Path, real: str = "double",
    force: np.ndarray | None = None, t_s: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """Compile a calibration's C header; return flag and rates of samples, (n, 1 + axes), at forces (n, 3) g.

    With times (n,) s the samples are steps of a unit that remembers, at forces.
    """
    content, media_type = export_calibration(calibration.to_bytes(), "c")
    assert media_type == "text/x-c"
    (folder / "calibration.h").write_bytes(content)
    name = next(
        line.split()[1] for line in content.decode().splitlines() if line.endswith(f"_AXES {len(calibration.axes)}")
    )
    name, axes = name.removesuffix("_AXES"), len(calibration.axes)
    call = f"{name}_correct(w, (LABCTL_REAL)t, rate)"
    if force is not None:
        call, raw = f"{name}_correct_with_force(w, (LABCTL_REAL)t, w + {axes}, rate)", np.column_stack([raw, force])
    if t_s is not None:
        call = f"{name}_step_with_force(&state, w, (LABCTL_REAL)t, in[{raw.shape[1]}], w + {axes}, rate)"
        raw = np.column_stack([raw, t_s])
    begin = "" if t_s is None else f"{name}_state state = {{0}};"
    source = MAIN.format(axes=axes, inputs=raw.shape[1], call=call, begin=begin)
    (folder / "main.c").write_text(source)
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [compiler, "-std=c99", *STRICT, f"-DLABCTL_REAL={real}", "-O1", "main.c"]
    subprocess.run([*command, "-o", "main", "-lm"], cwd=folder, check=True, capture_output=True)
    lines = "\n".join(f"{t:.17g} " + " ".join(f"{v:.17g}" for v in row) for t, row in zip(warm, raw, strict=True))
    out = subprocess.run([folder / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    return np.array([[float(word) for word in line.split()] for line in out.splitlines()])
