"""An adequate model still says which of its effects the data could not tell from others when they were added."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.answers.certification import CertificationResponse, CertifyRequest
from labctl.calibration import read_calibration
from labctl.errors import LabctlError, NotEnoughData
from labctl.fitting.effects import CATALOGUE
from labctl.probability_text import odds_text
from labctl.recording import read_recording
from labctl.services.calibrations.assessment import assess
from labctl.services.calibrations.certification import certify
from labctl.services.calibrations.fitting import fit_unit, one_version
from labctl.services.calibrations.revision import improve_unit
from labctl.services.calibrations.served import calibration_file
from labctl.services.criticism.criticise import _undistinguished, criticise_unit
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.examples import example
from labctl.services.recordings.loading import chosen_rows
from labctl.store import Store, open_store

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
GYRO = "OSU-FOG-2024"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    """Open a store with the real fibre-optic gyro, to whose first version a sine has been added."""
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        opened.recordings.add_import(read_recording(example("osu-fog")), AT)
        fit_unit(opened, GYRO, FitRequest(model="bias_scale"), AT)
        improve_unit(opened, GYRO, ImproveRequest(add=["sine_response"]), AT)
        yield opened


@pytest.mark.slow
def test_an_adequate_version_names_what_would_explain_its_data_as_well(store: Store) -> None:
    before, after = criticise_unit(store, GYRO, 1, None), criticise_unit(store, GYRO, 2, None)
    assert (before.verdict, before.undistinguished) == ("ambiguous", [])
    assert after.verdict == "adequate"
    assert after.undistinguished == [
        {"effect": "sine_response", "others": [name for name in before.named if name != "sine_response"], "version": 1}
    ]
    assert after.cause_not_known == [after.text[1]]
    assert after.text[1].startswith("These data do not show that the cause is sine_response")
    log_bf = {suspect["effect"]: suspect["log_bayes_factor"] for suspect in before.suspects}
    odds = odds_text(log_bf["sine_response"] - log_bf["scale_factor_odd"])
    why = f"of {len(before.named)} effects that cannot be distinguished the one with the most evidence, {odds} against"
    assert any(line.startswith(f"Adding sine_response is advised, {why} scale_factor_odd: on") for line in before.text)
    assert " With scale_factor_asymmetry the error falls from 0.0481" in after.why_not_named


@pytest.mark.slow
def test_a_size_that_is_not_usual_is_said_beside_one_that_is(store: Store) -> None:
    before, odd = criticise_unit(store, GYRO, 1, None), "scale_factor_odd"
    usual = {suspect["effect"]: suspect["usual_size"] for suspect in before.suspects}
    assert (usual["sine_response"], usual[odd]) == (True, False)
    largest = max(CATALOGUE[odd].ranges["fog"])
    improve_unit(store, GYRO, ImproveRequest(add=[odd], version=1), AT)
    value = store.calibrations.get(GYRO, 3).answer["axes"]["z"]["coefficients"]["scale_factor_r3"]["value"]
    assert abs(value) > largest
    assert (
        f"sine_response would be of a usual size; {odd} would not: its size would be {value * 1e6:.2g}e-06 (deg/s)^-2, "
        f"where 0 to {largest * 1e7:.0f}e-07 is usual for fog."
    ) in before.text


@pytest.mark.slow
def test_a_suspect_that_cannot_be_fitted_beside_the_model_says_why(store: Store) -> None:
    answer = criticise_unit(store, GYRO, 2, None)
    refused = {suspect["effect"]: suspect["fit_refused"] for suspect in answer.suspects if suspect["fit_refused"]}
    assert "sine_response and scale_factor_odd together are not determined" in refused["scale_factor_odd"]
    for effect, why in refused.items():
        with pytest.raises(LabctlError) as raised:
            improve_unit(store, GYRO, ImproveRequest(add=[effect], version=2), AT)
        assert why == str(raised.value)
        assert (
            f"{effect} (" not in answer.why_not_named
            or "but the model with it cannot be fitted" in answer.why_not_named
        )
    assert all(suspect["rms_after_dps"] is None for suspect in answer.suspects if suspect["fit_refused"])


@pytest.mark.slow
def test_what_a_verdict_does_not_show_goes_with_the_version(store: Store) -> None:
    (said,) = criticise_unit(store, GYRO, 2, None).cause_not_known
    known = assess(store, GYRO, 2)
    assert (known.objections, known.cause_not_known) == ([], [said])
    act = certify(store, GYRO, 2, CertifyRequest(by="Ada A.", reason="meets the criteria"), AT)
    assert isinstance(act, CertificationResponse)
    assert act.cause_not_known == [said]
    assert one_version(store, GYRO, 2).certification == act
    for version in (None, 2):
        content = calibration_file(store, GYRO, version, "json").content
        assert json.loads(content)["certification"]["cause_not_known"] == [said]
        certification = read_calibration(content).certification
        assert certification is not None
        assert certification.cause_not_known == (said,)
    certify(store, GYRO, 1, CertifyRequest(by="Ada A.", reason="back to the simple one", override=True), AT)
    assert "cause_not_known" not in json.loads(calibration_file(store, GYRO, None, "json").content)["certification"]


@pytest.mark.slow
def test_a_formula_is_said_to_name_no_cause_behind_the_verdict_and_the_warnings(store: Store) -> None:
    formula = "bend: rate_dps * abs(rate_dps)"
    improve_unit(store, GYRO, ImproveRequest(add=[], formula=[formula], version=2), AT)
    answer = criticise_unit(store, GYRO, 3, None)
    assert answer.verdict == "adequate"
    (of_the_version_before,) = criticise_unit(store, GYRO, 2, None).cause_not_known
    assert answer.cause_not_known == [
        of_the_version_before.replace("version 2", "version 3"),
        "The formula bend of version 3 describes the error; it names no cause.",
    ]
    assert [each["version"] for each in answer.undistinguished] == [1]
    place = len(answer.warnings) + 1
    assert answer.text[place : place + 2] == answer.cause_not_known


@pytest.mark.slow
def test_a_version_whose_effect_was_taken_out_again_is_asked_nothing(store: Store) -> None:
    improve_unit(store, GYRO, ImproveRequest(remove=["sine_response"], add=["scale_factor_odd"], version=2), AT)
    answer = criticise_unit(store, GYRO, 3, None)
    assert "sine_response" not in {each["effect"] for each in answer.undistinguished}


@pytest.mark.slow
def test_effects_that_data_cannot_distinguish_are_refused_together(store: Store) -> None:
    with pytest.raises(NotEnoughData, match="scale_factor_odd and sine_response together are not determined"):
        improve_unit(store, GYRO, ImproveRequest(add=["scale_factor_odd", "sine_response"], version=1), AT)


@pytest.mark.slow
def test_a_version_with_both_is_not_asked_which_it_is(store: Store) -> None:
    measured = chosen_rows(store, GYRO, None, ())
    alone = version_of(store, GYRO, 2)
    model = alone.answer["model"]
    effects = [*model["effects"], "scale_factor_odd"]
    both = replace(alone, answer={**alone.answer, "model": {**model, "effects": effects}})
    assert [each["effect"] for each in _undistinguished(store, alone, measured)] == ["sine_response"]
    assert list(_undistinguished(store, both, measured)) == []
