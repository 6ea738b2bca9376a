"""The table of a calibration, looked up by SciPy's interpolator, against the compensator."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.recording import Recording
from tests.helpers.calibrations import calibrated
from tests.helpers.exported import exported, stated, whole_range
from tests.helpers.recordings import Triaxial


def looked_up(text: str, axes: tuple[str, ...], raw: np.ndarray, warm: np.ndarray) -> np.ndarray:
    """Return corrected rates by the rows of the file, as its head says."""
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    rate = raw.copy()
    for column, axis in enumerate(axes):
        for index, by in enumerate(axes):
            own = [row for row in rows if (row["axis"], row["by_axis"]) == (axis, by)]
            grid = [np.unique([float(row[name]) for row in own]) for name in ("output_dps", "temperature_c")]
            values = np.array([float(row["error_dps"]) for row in own]).reshape(len(grid[0]), len(grid[1]))
            at = [np.clip(x, g[0], g[-1]) for x, g in zip((raw[:, index], warm), grid, strict=True)]
            rate[:, column] -= RegularGridInterpolator(grid, values)(np.column_stack(at))
    return rate


@pytest.mark.slow
def test_the_interpolation_error_is_within_the_stated_one(any_calibration: Calibration) -> None:
    text, _ = exported(any_calibration, "table-csv", outputs="15", temperatures="9")
    raw, warm = whole_range(any_calibration, temperatures=37)
    found = looked_up(text, any_calibration.axes, raw, warm)
    apart = np.abs(found - Compensator(any_calibration).compensate(raw, warm).rate_dps).max()
    bound = stated(text, "Rates corrected by this file differ from those of the calibration")
    assert 0.2 * bound < apart <= bound


def test_more_points_are_nearer(fog: Calibration) -> None:
    differs = [exported(fog, "table-csv", outputs=n, temperatures=n)[1].differs_dps for n in ("5", "9", "17")]
    sizes = [each for each in differs if each is not None]
    assert [sizes[1] / sizes[0], sizes[2] / sizes[1]] == pytest.approx([0.25, 0.25], rel=0.2)


def test_a_table_over_more_than_output_and_temperature_is_refused() -> None:
    recording = Triaxial(2).campaign(2)
    supply = np.random.default_rng(2).normal(5.0, 0.1, len(recording))
    fed = Recording(recording.info, {**recording.columns, "supply_v": supply}, recording.environment)
    fed_by = calibrated(fed, effects=["bias", "scale_factor", "supply_sensitivity"])
    for name in ("table-csv", "c-q31", "px4"):
        with pytest.raises(
            BadInput, match=rf"format {name}: model .* needs \w+.* beside output and temperature; .*use"
        ):
            exported(fed_by, name)
