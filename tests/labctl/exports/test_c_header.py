"""The C header of a calibration: compiled, it computes and flags what the compensator does."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration, read_calibration
from labctl.compensator import MARGIN_C, MARGIN_SHARE, Compensator
from labctl.errors import BadInput
from labctl.exports import export_calibration
from labctl.recording import Recording
from tests.helpers.c_header import in_c
from tests.helpers.calibrations import calibrated, inside

Grid = tuple[np.ndarray, np.ndarray]


@pytest.mark.slow
@pytest.mark.needs_cc
@pytest.mark.parametrize(
    ("real", "before", "most"), [("double", "from the calibration in double", 1e-10), ("float", "in single", 2e-3)]
)
def test_the_c_header_computes_the_same(
    any_calibration: Calibration, tmp_path: Path, real: str, before: str, most: float
) -> None:
    found = re.search(rf"([0-9.e+-]+) deg/s {before}", export_calibration(any_calibration.to_bytes(), "c")[0].decode())
    assert found is not None
    tolerance = float(found[1])  # as the header states it
    assert 0 < tolerance < most
    raw, warm = inside(any_calibration, 200)
    warm = np.append(warm, [any_calibration.temperature_c[1] + 50])
    raw = np.vstack([raw, raw[:1]])
    table = in_c(any_calibration, raw, warm, tmp_path, real)
    expected = Compensator(any_calibration).compensate(raw, warm)
    assert table[:, 1:] == pytest.approx(expected.rate_dps, abs=tolerance)
    assert table[:-1, 0].sum() == 0
    assert table[-1, 0] == 1


def test_what_has_no_closed_form_in_c_is_named_alone(
    make_points: Callable[..., Recording], grid_11_by_11: Grid
) -> None:
    rate, warm = grid_11_by_11
    bent = calibrated(make_points(rate, warm, rate * 1.01 + 0.1), effects=["bias", "scale_factor", "dead_band"])
    with pytest.raises(BadInput, match=r"without a closed form in C \(dead_band\)"):
        export_calibration(bent.to_bytes(), "c")


def around(low: float, high: float, margin: float) -> np.ndarray:
    """Return values on, just within and just beyond both edges of a range and of the range with its margin."""
    edges = np.array([low, high, low - margin, high + margin])
    just = np.concatenate([edges, np.nextafter(edges, -np.inf), np.nextafter(edges, np.inf)])
    return np.concatenate([just, edges - 0.3 * margin, edges + 0.3 * margin, np.linspace(low, high, 5), [np.nan]])


@pytest.mark.needs_cc
def test_c_flags_and_corrects_the_samples_that_python_does(any_calibration: Calibration, tmp_path: Path) -> None:
    (low, high), (slow, fast) = any_calibration.temperature_c, any_calibration.rate_dps
    temperatures, rates = around(low, high, MARGIN_C), around(slow, fast, MARGIN_SHARE * (fast - slow))
    warm, first = (grid.ravel() for grid in np.meshgrid(temperatures, rates))
    raw = np.column_stack([first, *(np.zeros((len(any_calibration.axes) - 1, len(first))))])
    table = in_c(any_calibration, raw, warm, tmp_path)
    expected = Compensator(any_calibration).compensate(raw, warm)
    assert 0 < expected.outside.sum() < len(raw)
    assert table[:, 0].astype(bool).tolist() == expected.outside.tolist()
    assert np.allclose(table[:, 1:], expected.rate_dps, rtol=0, atol=1e-9, equal_nan=True)


@pytest.mark.needs_cc
def test_a_model_without_a_rate_in_it_has_no_limit_of_rate(at_rest: Recording, tmp_path: Path) -> None:
    calibration = calibrated(at_rest, effects=["bias", "bias_temperature"])
    assert calibration.document["validity"]["rate_dps"] == [None, None]
    raw, warm = np.array([[0.1], [-300.0], [1e6], [np.nan], [0.1]]), np.array([30.0, 25.0, 35.0, 30.0, 60.0])
    found = Compensator(read_calibration(calibration.to_bytes())).compensate(raw, warm)
    assert found.outside.tolist() == [False, False, False, True, True]
    assert found.rate_dps[1, 0] == pytest.approx(-300.09, abs=0.01)
    assert in_c(calibration, raw, warm, tmp_path)[:, 0].astype(bool).tolist() == found.outside.tolist()
