"""The warm-up that comes with labctl, against the least-squares parabolas that its author printed."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting import fit, fit_data_of
from labctl.recording import read_recording
from tests.helpers.paths import EXAMPLES

#: Square, linear and constant term, in words of the output, over the word of the thermometer.
PRINTED = {
    "x": (-4.387634e-08, -5.878346e-04, 6.699801),
    "y": (-1.779335e-08, 1.172002e-03, 8.341212),
    "z": (4.216745e-09, -6.897733e-05, -21.71155),
}


@pytest.mark.parametrize("axis", "xyz")
def test_the_unweighted_parabola_is_the_authors(axis: str) -> None:
    recording = read_recording(EXAMPLES / "freeimu-warmup")
    columns = {
        name: np.asarray(values, dtype=np.float64) for name, values in recording.columns.items() if name != "position"
    }
    word = (columns["temperature_c"] - 36.53) * 340.0
    ours = np.polyfit(word, columns[f"gyro_{axis}"], 2, w=np.sqrt(columns["n"]))
    grid = np.linspace(word.min(), word.max(), 50)
    assert np.polyval(ours, grid) == pytest.approx(np.polyval(PRINTED[axis], grid), abs=0.01)  # of means, in words


@pytest.mark.parametrize("axis", "xyz")
def test_labctls_parabola_is_within_its_uncertainty_of_the_authors(axis: str) -> None:
    recording = read_recording(EXAMPLES / "freeimu-warmup")
    found = fit(recording, "bias_temperature")
    warm = np.linspace(12.0, 28.0, 9)
    printed = np.polyval(PRINTED[axis], (warm - 36.53) * 340.0) / 16.4
    centred = warm - found.fitted.model.reference.temperature_c
    design = np.column_stack([np.ones(9), centred, centred**2])
    of_axis = found.fitted.axes[axis]
    u = np.sqrt(np.einsum("ij,jk,ik->i", design, of_axis.covariance, design))
    assert np.all(np.abs(design @ of_axis.values[:, 0] - printed) < 2.5 * u)
    assert len(fit_data_of(recording)) == 128
