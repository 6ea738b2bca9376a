"""The Q31 header: compiled, it gives bit by bit what was measured when it was written; so does a Cortex-M4."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.exports import export_calibration
from labctl.exports.c_header import c_name
from labctl.exports.fixed_point.force import fixed_force
from labctl.exports.fixed_point.whole_numbers import fixed_point
from labctl.exports.static_part import static_part
from labctl.recording import Recording
from tests.helpers.c_fixed_point import compiled
from tests.helpers.calibrations import calibrated, with_force
from tests.helpers.cortex_m import INSTRUCTIONS_PER_TICK, TICKS, on_cortex_m
from tests.helpers.exported import exported, stated, whole_range

Grid = tuple[np.ndarray, np.ndarray]


@pytest.mark.slow
@pytest.mark.needs_cc
@pytest.mark.parametrize("any_calibration", ["fog", "mems", "plain", "open_loop"], indirect=True)
def test_the_code_gives_the_stated_numbers_bit_by_bit(any_calibration: Calibration, tmp_path: Path) -> None:
    text, _ = exported(any_calibration, "c-q31")
    fixed = fixed_point(static_part(any_calibration, "c-q31", carries=""), 65, "c-q31")
    raw, warm = whole_range(any_calibration)
    inputs, hot = fixed.as_q31(raw), np.rint(warm * 65536).astype(np.int64)
    inside = len(inputs)
    ends = [2**31 - 1, -(2**31), 0, 1]
    inputs = np.vstack([inputs, np.repeat(np.array(ends)[:, None], inputs.shape[1], axis=1)])
    hot = np.append(hot, [2**31 - 1, -(2**31), 2**31 - 1, -(2**31)])
    found = compiled(tmp_path, any_calibration, np.column_stack([hot, inputs]))
    rates, outside = fixed.corrected(inputs, hot)
    assert np.array_equal(found[:, 1:], rates)
    assert np.array_equal(found[:, 0].astype(bool), outside)
    assert not outside[:inside].any()
    assert outside[inside:].all()
    apart = (
        found[:inside, 1:] * fixed.full_scale_dps / 2**31 - Compensator(any_calibration).compensate(raw, warm).rate_dps
    )
    assert np.abs(apart).max() <= stated(text, "Rates corrected by this file differ from those of the calibration")


def test_the_tables_are_nearer_with_more_temperatures(mems: Calibration) -> None:
    sizes = [exported(mems, "c-q31", temperatures=n)[1].differs_dps or 0.0 for n in ("9", "129")]
    assert sizes[1] < 0.1 * sizes[0]


@pytest.mark.slow
def test_axes_whose_errors_do_not_add_up_are_refused(open_loops: Calibration) -> None:
    """A sum over the outputs would be wrong by 0.6 deg/s while three axes turn, and right while one does."""
    with pytest.raises(BadInput, match=r"while several axes turn model .* differs from this sum by up to 0\.6"):
        export_calibration(open_loops.to_bytes(), "c-q31")


ON_ARM = """
#include <stdio.h>
{ticks}
#define LABCTL_REAL float
#include "float.h"
#include "q31.h"
static const int32_t in[{n}][{axes} + 4] = {{{rows}}};
static float real[{n}][{axes}], hot[{n}], force[{n}][3], real_rate[2][{n}][{axes}];
static int32_t rate[2][{n}][{axes}];
int main(void) {{
    uint32_t begun, took[4]; int i, a, flags = 0;
    for (i = 0; i < {n}; i++) {{
        hot[i] = (float)in[i][0] / 65536.0f;
        for (a = 0; a < 3; a++) force[i][a] = (float)in[i][{axes} + 1 + a] / 65536.0f;
        for (a = 0; a < {axes}; a++) real[i][a] = (float)in[i][a + 1] * {scale:.9g}f;
    }}
    ticks_begin();
    begun = ticks();
    for (i = 0; i < {n}; i++) flags += {name}_q31_correct(in[i] + 1, in[i][0], rate[0][i]);
    took[0] = ticks() - begun;
    begun = ticks();
    for (i = 0; i < {n}; i++) flags += {name}_correct(real[i], hot[i], real_rate[0][i]);
    took[1] = ticks() - begun;
    begun = ticks();
    for (i = 0; i < {n}; i++)
        flags += {name}_q31_correct_with_force(in[i] + 1, in[i][0], in[i] + {axes} + 1, rate[1][i]);
    took[2] = ticks() - begun;
    begun = ticks();
    for (i = 0; i < {n}; i++) flags += {name}_correct_with_force(real[i], hot[i], force[i], real_rate[1][i]);
    took[3] = ticks() - begun;
    printf("ticks");
    for (a = 0; a < 4; a++) printf(" %u", (unsigned)took[a]);
    printf(" %d\\n", flags);
    for (a = 0; a < 2 * {n} * {axes}; a++)
        printf("%d %.9g\\n", (int)(&rate[0][0][0])[a], (double)(&real_rate[0][0][0])[a]);
    return 0;
}}
"""
SAMPLES = 40


@pytest.mark.slow
@pytest.mark.needs_cortex_m
@pytest.mark.parametrize("which", ["fog", "mems"])
def test_a_cortex_m4_computes_the_same(request: pytest.FixtureRequest, tmp_path: Path, which: str) -> None:
    plain: Calibration = request.getfixturevalue(which)
    axes, rng = len(plain.axes), np.random.default_rng(4)
    calibration = with_force(plain, rng.normal(0, 0.03, (axes, 3)), rng.normal(0, 0.003, axes))
    for name, file in (("c", "float.h"), ("c-q31", "q31.h")):
        (tmp_path / file).write_bytes(export_calibration(calibration.to_bytes(), name)[0])
    fixed = fixed_point(static_part(calibration, "c-q31", carries=""), 65, "c-q31")
    raw, warm = (values[-SAMPLES:] for values in whole_range(calibration))
    raw, pull = 0.9 * raw, rng.uniform(-16, 16, (SAMPLES, 3))
    inputs, hot, force = fixed.as_q31(raw), *(np.rint(each * 65536).astype(np.int64) for each in (warm, pull))
    rows = ", ".join("{" + ", ".join(map(str, row)) + "}" for row in np.column_stack([hot, inputs, force]).tolist())
    source = ON_ARM.format(ticks=TICKS, n=SAMPLES, axes=raw.shape[1], rows=rows, name=c_name(calibration.serial),
                           scale=fixed.full_scale_dps / 2**31)  # fmt: skip
    (tmp_path / "main.c").write_text(source)
    lines = on_cortex_m(tmp_path).splitlines()
    found = np.array([[float(word) for word in line.split()] for line in lines[1:]]).reshape(2, SAMPLES, -1, 2)
    assert calibration.force_sensitivity is not None
    is_direct = calibration.fitted.model.argument == "output"
    forced = fixed_force(fixed, calibration.force_sensitivity, "c-q31", is_direct=is_direct)
    assert np.array_equal(found[0, :, :, 0], fixed.corrected(inputs, hot)[0])
    assert np.array_equal(found[1, :, :, 0], forced.corrected(inputs, hot, force)[0])
    compensator = Compensator(calibration)
    assert np.abs(found[0, :, :, 1] - compensator.compensate(raw, warm).rate_dps).max() < 2e-3
    by_force = compensator.compensate(raw, warm, specific_force_g=pull).rate_dps
    assert np.abs(found[1, :, :, 1] - by_force).max() < 2e-3
    *ticks, flags = (int(word) for word in lines[0].split()[1:])
    assert flags == 0
    instructions = [INSTRUCTIONS_PER_TICK * count / SAMPLES for count in ticks]
    assert all(20 < each < 20_000 for each in instructions), instructions


def test_the_stated_difference_holds_where_a_table_over_temperature_bends(
    make_points: Callable[..., Recording], grid_11_by_11: Grid
) -> None:
    rate, even = grid_11_by_11
    warm = 25 + 20 * ((even - 25) / 20) ** 1.3
    zigzag = np.where(np.arange(121) // 11 % 2, 0.3, -0.3)  # another slope between every two temperatures
    bent = calibrated(make_points(rate, warm, rate * 1.01 + zigzag), "weiss1995")
    _, written = exported(bent, "c-q31", temperatures="129")
    fixed = fixed_point(static_part(bent, "c-q31", carries=""), 129, "c-q31")
    dense = np.linspace(*bent.temperature_c, 20_001)
    raw = np.full((len(dense), 1), 50.0)
    apart = fixed.rate_dps(raw, dense) - Compensator(bent).compensate(raw, dense).rate_dps
    assert np.abs(apart).max() <= (written.differs_dps or 0.0)
