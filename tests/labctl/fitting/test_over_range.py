"""The largest U over a range: that of the document, a lower bound of it, and what may be wrong with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from labctl.calibration import build_calibration
from labctl.fitting import fit
from labctl.fitting.uncertainty import evidence_of
from labctl.fitting.uncertainty.over_range import (
    CANNOT_LEAVE_OUT,
    LargestU,
    Range,
    data_and_preset,
    lack_of_fit,
    largest_u,
    least_u,
    unreachable_below,
)
from labctl.recording import Recording, RecordingInfo, to_points
from tests.helpers.recordings import STARTED, Triaxial, points
from tests.helpers.simulated_recordings import single_axis


def rows(recording: Recording, chosen: Any) -> Recording:
    return replace(recording, columns={name: values[chosen] for name, values in recording.columns.items()})


@pytest.fixture(scope="module")
def means() -> Recording:
    return to_points(single_axis())


def range_of(recording: Recording, **options: Any) -> Range:
    warm, rate = recording.columns["temperature_c"], recording.columns["table_rate_dps"]
    ends = (float(warm.min()), float(warm.max()))
    return Range((float(rate.min()), float(rate.max())), ends, **options)


def test_it_is_the_bound_of_the_document_over_the_same_range(means: Recording) -> None:
    result, evidence = fit(means, "ojeda2000"), evidence_of(means, "ojeda2000", None)
    calibration = build_calibration(
        means.info, result, version=1, parent=None, issued_at=STARTED, provenance={}, evidence=evidence
    )
    document: Any = calibration.document
    validity, bound = document["validity"], document["uncertainty"]["axes"]["z"]
    over = Range(tuple(validity["rate_dps"]), tuple(validity["temperature_c"]))
    found = largest_u(*data_and_preset(means, "ojeda2000", []), over)
    assert found.u_dps == pytest.approx(bound["bound_dps"], rel=1e-12)
    assert (found.rate_dps, found.temperature_c) == (bound["rate_dps"], bound["temperature_c"])


@pytest.mark.parametrize("sets", [60, 90, 121])
def test_the_lower_bound_is_below_u(means: Recording, sets: int) -> None:
    order = np.random.default_rng(5).permutation(len(means))[:sets]
    part = rows(means, np.sort(order))
    data, preset = data_and_preset(part, "ojeda2000", [])
    found, least = largest_u(data, preset, range_of(part)), least_u(data, preset, range_of(part))
    assert found.u_dps is not None
    assert least.u_dps is not None
    assert 0 < least.u_dps < found.u_dps


@pytest.mark.slow
def test_a_lower_bound_is_below_u_of_three_axes_too() -> None:
    recording = Triaxial(3).campaign(3)
    data, preset = data_and_preset(recording, "yang2018", [])
    over = Range((-400.0, 400.0), (-40.0, 50.0), repeatability=False)
    found, least = largest_u(data, preset, over), least_u(data, preset, over)
    assert found.u_dps is not None
    assert least.u_dps is not None
    assert 0 < least.u_dps < found.u_dps


def test_both_are_unknown_until_the_data_sets_determine_the_model(means: Recording) -> None:
    data, preset = data_and_preset(rows(means, slice(0, 12)), "ojeda2000", [])
    for found in (largest_u(data, preset, range_of(means)), least_u(data, preset, range_of(means))):
        assert found.u_dps is None
        assert "different temperatures" in found.why


def test_u_beyond_what_was_measured_is_unknown(means: Recording) -> None:
    data, preset = data_and_preset(means, "ojeda2000", [])
    over = Range((-100.0, 100.0), (0.0, 46.0))
    found = largest_u(data, preset, over)
    assert found.u_dps is None
    assert "no data set was measured near there" in found.why


def test_without_repeatability_u_is_smaller(means: Recording) -> None:
    data, preset = data_and_preset(means, "ojeda2000", [])
    later, same = (largest_u(data, preset, range_of(means, repeatability=each)) for each in (True, False))
    assert later.u_dps is not None
    assert same.u_dps is not None
    assert same.u_dps < later.u_dps


def bent(bend_dps: float, temperatures: int = 7) -> Recording:
    """Return means of a unit whose bias has a cubic in temperature that no quadratic follows."""
    rng = np.random.default_rng(8)
    warm = np.repeat(np.linspace(20.0, 44.0, temperatures), 9)
    rate = np.tile(np.linspace(-100.0, 100.0, 9), temperatures)
    u = (warm - 32.0) / 12.0
    output = rate + 0.01 * u + bend_dps * (4 * u**3 - 3 * u) + rng.normal(0, 5e-4, len(warm))
    recording = points(rate, warm, output)
    std = np.full(len(warm), 5e-4 * 10.0)
    return replace(recording, columns={**recording.columns, "n": np.full(len(warm), 100), "gyro_z_std": std})


def test_a_wrong_law_of_temperature_is_seen_before_u_is_believed() -> None:
    for bend_dps, is_seen in ((0.0, False), (0.01, True)):
        data, preset = data_and_preset(bent(bend_dps), "ojeda2000", [])
        said = lack_of_fit(data, preset, Range((-100.0, 100.0), (20.0, 44.0)), 0.003)
        assert bool(said) is is_seen, said


def test_as_many_temperatures_as_coefficients_show_no_lack_of_fit() -> None:
    data, preset = data_and_preset(bent(0.01, temperatures=3), "ojeda2000", [])
    assert lack_of_fit(data, preset, Range((-100.0, 100.0), (20.0, 44.0)), 0.003) == CANNOT_LEAVE_OUT


def test_more_data_sets_help_as_far_as_the_coefficients_are_the_reason() -> None:
    parts = {"coefficients": 0.002, "clock": 0.001}
    found = LargestU(2 * np.hypot(0.002, 0.001), parts_dps=parts, noise_dps=0.004)
    # U of 0.003 leaves 0.0015^2 - 0.001^2 for the variance of the coefficients, and precisions add
    needed = 0.004**2 * (1 / (0.0015**2 - 0.001**2) - 1 / 0.002**2)
    assert found.more_sets(0.003) == int(np.ceil(needed))
    assert found.more_sets(0.0019) is None  # the clock alone is more
    assert found.more_sets(1.0) is None  # it is reached


def test_what_the_bench_cannot_do_better_is_known_before() -> None:
    clock: Any = {"quantity": "clock", "name": "quartz", "u": 50.0}
    info = RecordingInfo(
        serial="A", axes=("z",), kind="samples", started_at=STARTED, standards=(clock,),
        datasheet={"bias_repeatability_dps": 0.001},
    )  # fmt: skip
    over = Range((-400.0, 400.0), (-40.0, 50.0))
    two_runs, one_run = unreachable_below(info, over, 2), unreachable_below(info, over, 1)
    assert two_runs.u_dps == pytest.approx(2 * 50e-6 * 400, rel=1e-3)
    assert two_runs.rate_dps in {-400, 400}
    assert one_run.u_dps is not None
    assert two_runs.u_dps is not None
    assert one_run.u_dps > two_runs.u_dps
    nothing = info.model_copy(update={"datasheet": {}})
    assert unreachable_below(nothing, over, 1).u_dps is None
    assert unreachable_below(nothing, replace(over, repeatability=False), 1).u_dps is not None
