"""The Python module of a calibration: alone, it corrects and flags what the compensator does."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import MARGIN_C, MARGIN_SHARE, Compensator
from labctl.errors import BadInput
from labctl.recording import Recording
from tests.helpers.calibrations import calibrated, inside
from tests.helpers.exported import exported

Grid = tuple[np.ndarray, np.ndarray]


@pytest.mark.slow
def test_the_module_alone_computes_the_same(any_calibration: Calibration) -> None:
    text, written = exported(any_calibration, "python")
    imported = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [[name.name for name in node.names] for node in imported if isinstance(node, ast.Import)] == [["math"]]
    assert len(imported) == 1
    module: dict[str, Any] = {}
    exec(compile(text, "calibration.py", "exec"), module)
    raw, warm = inside(any_calibration, 100)
    (low, high), (slow, fast) = any_calibration.temperature_c, any_calibration.rate_dps
    beyond = MARGIN_SHARE * (fast - slow)
    edges = [slow, fast, slow - beyond, fast + beyond, fast + 1.01 * beyond, slow - 2 * beyond, fast, np.nan]
    raw = np.vstack([raw, np.repeat(np.array(edges)[:, None], raw.shape[1], axis=1)])
    warm = np.append(warm, [low, high, low - MARGIN_C, high + 0.9 * MARGIN_C, low, high, high + 9.0, low])
    expected = Compensator(any_calibration).compensate(raw, warm)
    found = [module["correct"](row, at) for row, at in zip(raw.tolist(), warm.tolist(), strict=True)]
    assert [outside for _, outside in found] == expected.outside.tolist()
    assert written.differs_dps == 1e-9
    rates = np.array([rates for rates, _ in found])
    assert np.nanmax(np.abs(rates - expected.rate_dps)) <= written.differs_dps
    assert module["CALIBRATION"]["hash"] == any_calibration.hash
    with pytest.raises(ValueError, match="give one output for each axis"):
        module["correct"]([0.0] * 4, 25.0)


def test_a_model_without_a_closed_form_is_refused(make_points: Callable[..., Recording], grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    bent = calibrated(make_points(rate, warm, rate * 1.01 + 0.1), effects=["bias", "scale_factor", "dead_band"])
    with pytest.raises(BadInput, match=r"format python: .* without a closed form \(bias, scale_factor, dead_band\)"):
        exported(bent, "python")
