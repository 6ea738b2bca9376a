"""The study of proposed laws: sizes, what the model absorbs, and what lies outside the range, of one recording."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.fitting.criticism import fit_means
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import usual_model
from labctl.recording import Recording
from studies import laws
from studies.foreign_laws import SHAPES, kind_of_law
from studies.laws import Case, Witness, recorded, with_law

CASE = Case("single-axis", 3, "rate_fringes", 100.0)


def test_a_law_is_as_large_as_its_z_says() -> None:
    plain, added = (fit_data_of(recording) for recording in (recorded(CASE.schedule, CASE.seed, 0), with_law(CASE, 0)))
    hidden_dps = added.outputs["z"] - plain.outputs["z"]
    floor_dps = plain.noise_floor.axes["z"].floor_dps
    _, share = laws.unit_size(CASE.schedule, CASE.seed, CASE.law)
    assert share > 0.9  # fringes are no cubic
    assert np.linalg.norm(hidden_dps / floor_dps) == pytest.approx(CASE.z / share, rel=1e-6)


@pytest.mark.parametrize("law", SHAPES)
def test_every_law_bends_the_output_on_both_recordings_alike(law: str) -> None:
    day, other = (_hidden_dps(law, recorded(CASE.schedule, CASE.seed, number)) for number in (0, 1))
    for values in (day, other):
        assert np.all(np.isfinite(values))
        assert float(np.ptp(values)) > 0.02
    assert float(np.ptp(other)) == pytest.approx(float(np.ptp(day)), rel=0.5)


def _hidden_dps(law: str, plain: Recording) -> NDArray[np.float64]:
    added = kind_of_law(law, 100.0).added(plain, 0, 1.0)
    return added.gyro_dps("z") - plain.gyro_dps("z")


def test_a_fit_without_the_law_is_wrong_by_all_of_it_and_the_known_form_by_its_noise() -> None:
    recording, plain = with_law(CASE, 0), recorded(CASE.schedule, CASE.seed, 0)
    base = fit_means(recording, usual_model(fit_data_of(recording))).base
    witness = Witness.of(fit_data_of(recording), fit_data_of(plain))
    assert witness.error(base.fitted.model, base) == pytest.approx(1.0, abs=1e-6)
    assert 0 < witness.known_form(base.fitted.model) < 5 / CASE.z
