"""The C code of every form over random points of the calibrated range, beside the bound that its header states.

Each header is compiled with the warnings below as errors. A row has the largest difference from the Compensator,
deg/s, over LABCTL_STUDY_POINTS points (10^6) drawn with a fixed seed: outputs over the whole range of rates, on all
axes at once, temperatures over the whole range, specific forces up to 16 g along each axis. A bound that does not hold
ends the study with an error.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.exports import written_calibration
from labctl.exports.c_header import c_name
from labctl.fitting.numeric.rounding import at_most
from studies.c_units import UNITS

POINTS = int(os.environ.get("LABCTL_STUDY_POINTS", "1000000"))
SEED, MAX_G = 20_260, 16.0
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror")
#: Samples of a unit that remembers are so far apart, s; its temperature goes up and down in 2 pi times the second.
STEP_S, SWING_S = 0.1, 900.0
MAIN = """
#include <stdio.h>
#include <stdlib.h>
#include "calibration.h"
typedef {number} number;
int main(void) {{
    number in[{inputs}], rate[{axes}]; double t_s = 0; int a, flags = 0;
    {begin}
    while (fread(in, sizeof in, 1, stdin) == 1) {{
        flags += {call};
        t_s += {step};
        for (a = 0; a < {axes}; a++) if (fwrite(&rate[a], sizeof rate[a], 1, stdout) != 1) return 1;
    }}
    return t_s < 0 || flags > 0;
}}
"""


@dataclass(frozen=True)
class Points:
    """What a unit is given: outputs (n, axes), temperatures (n,), forces (n, 3) or None, and what it gives."""

    raw: np.ndarray
    warm: np.ndarray
    force: np.ndarray | None
    rate: np.ndarray


def drawn(calibration: Calibration, n: int) -> Points:
    """Return points inside a calibration's range, and the Compensator's rates, (n, axes) deg/s."""
    rng = np.random.default_rng(SEED)
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    slow, fast = (slow, fast) if np.isfinite(fast - slow) else (-300.0, 300.0)
    compensator = Compensator(calibration)
    warm = np.full(n, 25.0) if not np.isfinite(high - low) else rng.uniform(low, high, n)
    known: dict[str, np.ndarray] = {}
    if compensator.remembers:
        t_s = np.concatenate([[0.0], np.cumsum(np.full(n - 1, STEP_S))])
        warm = low + (high - low) * (0.5 + 0.5 * np.sin(t_s / SWING_S + rng.uniform()))
        known = {"t_s": t_s}
    force = rng.uniform(-MAX_G, MAX_G, (n, 3)) if calibration.force_sensitivity is not None else None
    raw = rng.uniform(slow, fast, (n, len(calibration.axes)))
    if force is not None:  # an output with the force's part taken off is inside too
        raw *= 0.9
    found = compensator.compensate(raw, warm, known, specific_force_g=force)
    return Points(raw, warm, force, found.rate_dps)


def compiled(calibration: Calibration, header: bytes, number: str, rows: np.ndarray, folder: Path) -> np.ndarray:
    """Return the rates of rows of outputs, temperature and forces by a header, (n, axes), in its own numbers."""
    name, axes = c_name(calibration.serial), len(calibration.axes)
    is_whole, remembers = number == "int32_t", Compensator(calibration).remembers
    prefix = f"{name}_q31" if is_whole else name
    with_force = "_with_force" if calibration.force_sensitivity is not None else ""
    force = f"in + {axes + 1}, " if with_force else ""
    call = f"{prefix}_correct{with_force}(in, in[{axes}], {force}rate)"
    begin = ""
    if remembers and not is_whole:
        call, begin = (
            f"{name}_step{with_force}(&state, in, in[{axes}], t_s, {force}rate)",
            f"{name}_state state = {{0}};",
        )
    (folder / "calibration.h").write_bytes(header)
    source = MAIN.format(number=number, inputs=rows.shape[1], axes=axes, begin=begin, call=call, step=STEP_S)
    (folder / "main.c").write_text(source)
    compiler = shutil.which("cc") or "cc"
    real = [] if is_whole else [f"-DLABCTL_REAL={number}"]
    subprocess.run([compiler, *FLAGS, *real, "main.c", "-o", "main", "-lm"], cwd=folder, check=True)
    kind = {"double": np.float64, "float": np.float32, "int32_t": np.int32}[number]
    said = subprocess.run([folder / "main"], input=rows.astype(kind).tobytes(), check=True, capture_output=True).stdout
    return np.frombuffer(said, dtype=kind).reshape(-1, axes).astype(np.float64)


def variants(
    calibration: Calibration, given: Points, folder: Path
) -> Iterator[tuple[str, float, float] | tuple[str, None, None]]:
    """Yield variant, largest difference and the bound that is stated, deg/s; None where it refuses the model."""
    header = written_calibration(calibration.to_bytes(), "c").content
    rows = np.column_stack([given.raw, given.warm, *([given.force] if given.force is not None else [])])
    for number, before in (("double", "from the calibration in double"), ("float", "in single")):
        rates = compiled(calibration, header, number, rows, folder)
        yield number, float(np.abs(rates - given.rate).max()), _stated(header, before)
    if np.isfinite(calibration.temperature_c).all() and not Compensator(calibration).remembers:
        try:
            found = _fixed(calibration, given, folder)
        except BadInput:
            yield "Q31, refused", None, None
        else:
            yield ("Q31", *found)


def _stated(header: bytes, before: str) -> float:
    """Return the bound that stands in a header before these words, deg/s."""
    found = re.search(r"([0-9.e+-]+) deg/s " + before, header.decode())
    if found is None:
        raise ValueError(f"the header states no bound {before}")
    return float(found[1])


def _fixed(calibration: Calibration, given: Points, folder: Path) -> tuple[float, float]:
    written = written_calibration(calibration.to_bytes(), "c-q31")
    line = next(line for line in written.content.decode().splitlines() if "_Q31_FULL_SCALE_DPS" in line)
    scale = float(line.split()[-1]) / 2.0**31
    whole = [np.rint(given.raw / scale), np.rint(given.warm * 65536)]
    whole += [np.rint(given.force * 65536)] if given.force is not None else []
    rates = compiled(calibration, written.content, "int32_t", np.column_stack(whole), folder) * scale
    return float(np.abs(rates - given.rate).max()), at_most(written.differs_dps or 0.0)


def lines(units: dict[str, Callable[[], Calibration]], points: int) -> Iterator[str]:
    """Yield the rows of a Markdown table; raises ValueError for a bound that does not hold."""
    yield "| model | axes | variant | largest difference, deg/s | stated bound, deg/s |"
    yield "| --- | --- | --- | --- | --- |"
    for name, made in units.items():
        calibration = made()
        given = drawn(calibration, points)
        with tempfile.TemporaryDirectory() as folder:
            for variant, off, bound in variants(calibration, given, Path(folder)):
                if off is None or bound is None:
                    yield f"| {name} | {len(calibration.axes)} | {variant} | – | – |"
                    continue
                yield f"| {name} | {len(calibration.axes)} | {variant} | {off:.2g} | {bound:.3g} |"
                if not off <= bound:
                    raise ValueError(f"{name}, {variant}: {off:.3g} deg/s beyond the stated bound of {bound:.3g} deg/s")


def run() -> str:
    """Print the table of all units row by row, and return the number of points and the compiler flags."""
    for line in lines(UNITS, POINTS):
        print(line, flush=True)
    return f"\n{POINTS} points each, compiled with {' '.join(FLAGS[1:])}; every bound holds"
