"""One output in rad/s among those in deg/s, and what only looks like it: quiet while another axis is turned."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.recording.sanity.readings.mixture import check_units
from labctl.recording.sanity.readings.series import Series

READINGS, RATES = 200, (-200.0, -50.0, 50.0, 200.0)
#: How much noisier an output is while the table turns about its axis, near 180/pi; and how far it is misaligned.
TABLE_NOISE, MISALIGNMENT = 50.0, 1 / 57.0
AXES = "xyz"


def campaign(*, in_rad: tuple[int, int] | None = None) -> Series:
    """Return three mountings, each output noisy in its own; `in_rad` is a span of data sets of gyro_y in rad/s."""
    rng = np.random.default_rng(5)
    rate = np.repeat(np.tile(RATES, 3), READINGS)
    turned = np.repeat(np.arange(3), len(RATES) * READINGS)
    outputs = {}
    for axis in range(3):
        own = turned == axis
        noise = rng.normal(0.0, 0.01, len(rate)) * np.where(own, TABLE_NOISE, 1.0)
        outputs[f"gyro_{AXES[axis]}"] = np.where(own, rate, MISALIGNMENT * rate) + noise
    if in_rad is not None:
        rows = slice(in_rad[0] * READINGS, in_rad[1] * READINGS)
        outputs["gyro_y"][rows] *= np.pi / 180
    n = len(rate)
    t_s, dataset = 0.01 * np.arange(n, dtype=np.float64), np.repeat(np.arange(n // READINGS), READINGS)
    return Series(t_s, dataset, rate, np.zeros(n, dtype=bool), outputs, {}, {}, "rates")


def test_an_output_that_is_quiet_while_another_axis_is_turned_is_in_its_unit() -> None:
    assert list(check_units(campaign())) == []


@pytest.mark.parametrize("span", [(4, 6), (6, 8)])
def test_an_output_in_rad_s_while_its_own_axis_is_turned_is_found(span: tuple[int, int]) -> None:
    (found,) = check_units(only_own_axis(campaign(in_rad=span)))
    assert (found.finding.what, found.finding.channel) == ("mixed_units", "gyro_y")
    expected = np.zeros(len(found.rows), dtype=bool)
    expected[(span[0] - 4) * READINGS : (span[1] - 4) * READINGS] = True
    assert found.rows.tolist() == expected.tolist()


def only_own_axis(series: Series) -> Series:
    """Return the mounting of a campaign in which gyro_y is turned."""
    rows = slice(4 * READINGS, 8 * READINGS)
    assert series.rate_dps is not None
    return Series(
        series.t_s[rows], series.dataset[rows] - 4, series.rate_dps[rows], series.still[rows],
        {name: values[rows] for name, values in series.outputs.items()}, {}, {}, "rates",
    )  # fmt: skip
