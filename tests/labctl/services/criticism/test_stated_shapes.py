"""A shape that a person states is kept by the fit; everything else of the model is fitted beside it."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest, ImproveRequest, PreviewResponse
from labctl.recording import read_recording
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.revision import preview_unit
from labctl.services.recordings.examples import example
from labctl.store import Store, open_store

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
GYRO = "OSU-FOG-2024"


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """Open a store with the real fibre-optic gyro, fitted by bias and scale factor."""
    with open_store(str(tmp_path_factory.mktemp("shapes") / "lab.sqlite"), write=True) as opened:
        opened.recordings.add_import(read_recording(example("osu-fog")), AT)
        fit_unit(opened, GYRO, FitRequest(effects=["bias", "scale_factor"]), AT)
        yield opened


def preview(store: Store, term: str) -> PreviewResponse:
    return preview_unit(store, GYRO, ImproveRequest(add=[term]))


def shape(answer: PreviewResponse) -> dict[str, float]:
    assert answer.model.terms is not None
    return answer.model.terms[-1]["parameters"]


@pytest.mark.slow
def test_the_best_shape_leaves_less_than_any_other_and_stated_again_leaves_the_same(store: Store) -> None:
    best = preview(store, "saturation")
    found = shape(best)["knee_dps"]
    again = preview(store, f"saturation@knee_dps={found!r}")
    assert again.error.rms_dps == best.error.rms_dps
    others = [preview(store, f"saturation@knee_dps={knee}") for knee in (25.0, 0.8 * found, 1.25 * found)]
    assert [shape(each) for each in others] == [{"knee_dps": k} for k in (25.0, 0.8 * found, 1.25 * found)]
    assert all(each.error.rms_dps > best.error.rms_dps for each in others)


def test_what_is_left_with_a_stated_knee_is_that_of_plain_least_squares(store: Store) -> None:
    knee = 80.0
    columns = read_recording(example("osu-fog")).columns
    rate, output = (np.asarray(columns[name], dtype=float) for name in ("table_rate_dps", "gyro_z"))
    beyond = np.sign(rate) * np.maximum(np.abs(rate) - knee, 0.0)
    design = np.column_stack([np.ones_like(rate), rate, beyond])
    coefficients = np.linalg.lstsq(design, output, rcond=None)[0]
    slope = coefficients[1] + coefficients[2] * (np.abs(rate) > knee)  # V per deg/s: the output is a voltage
    left = (output - design @ coefficients) / slope
    answer = preview(store, f"saturation@knee_dps={knee}")
    assert answer.error.rms_dps == pytest.approx(np.sqrt(np.mean(left**2)), rel=0.01)
