"""Certification knows the verdict: it is kept with the act, and objections to a version have to be overridden."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from labctl.answers.criticism import CriticismResponse
from labctl.recording import to_points, write_recording
from labctl.services.calibrations import assessment
from labctl.services.calibrations.assessment import MIN_REASON_CHARACTERS, MIN_REASON_WORDS, assess
from labctl.store import open_store
from tests.helpers.certifying import OVERRIDE, OVERRIDE_OPTIONS, REASON
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES
from tests.helpers.service import open_client
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.spoilt import scaled, spoilt

FOG, TABLE, SIMULATED = "OSU-FOG-2024", "WEISS-ENV05S", "FOG-0001"
BY = ("--by", "A. Person")

pytestmark = pytest.mark.usefixtures("shared_answers")


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    lab = Lab(tmp_path)
    lab.run("import", str(EXAMPLES / "osu-fog"))
    return lab


@pytest.mark.slow
def test_an_adequate_version_is_certified_with_its_verdict(lab: Lab) -> None:
    lab.run("fit", FOG, "--model", "ojeda2000")
    criticised = lab.json("criticise", FOG)
    act = lab.json("certify", FOG, "1", *BY, "--reason", "fits")
    assert (act["verdict"], act["verdict_recording"], act["verdict_reason"]) == ("adequate", 1, "")
    assert act["verdict_at"] == act["at"]
    assert act["verdict_text"] == criticised["text"][0]
    assert (act["override"], act["objections"]) == (False, [])
    assert act["error"]["heldout_rms_dps"] == pytest.approx(0.0512, rel=0.01)
    assert lab.json("certifications", FOG) == [act]
    (row,) = [each for each in lab.json("audit", "list") if each["action"] == "certify"]
    assert (row["detail"]["verdict"], row["detail"]["recording"], row["detail"]["override"]) == ("adequate", 1, False)
    assert lab.json("audit", "verify")["ok"] is True
    revoked = lab.json("revoke", FOG, "1", *BY, "--reason", "dropped")
    assert (revoked["verdict"], revoked["override"], revoked["objections"]) == (None, None, [])


@pytest.mark.slow
def test_what_lacks_something_is_refused_in_one_line_unless_overridden(lab: Lab) -> None:
    lab.run("fit", FOG, "--effects", "bias,scale_factor")
    before = lab.content()
    refused = lab.run("certify", FOG, "1", *BY, "--reason", "a good reason, long enough", status=2).stderr
    assert refused.count("\n") == 1
    assert "certification of version 1 of OSU-FOG-2024 is refused: the verdict on recording 1 is 'ambiguous'" in refused
    assert "(RMS error 0.536" in refused
    assert "deg/s, noise floor 0.0333" in refused
    assert "labctl criticise OSU-FOG-2024 --version 1" in refused
    assert f"at least {MIN_REASON_CHARACTERS} characters and {MIN_REASON_WORDS} words" in refused
    for reason in ("x", "two words are not enough"[:9], "abcdefghijklmnopqrstuvwxyz", "a b c", "a b c" + 40 * " "):
        short = lab.run("certify", FOG, "1", *BY, "--reason", reason, "--override", status=2).stderr
        assert "is too short for an override" in short
    assert lab.content() == before
    act = lab.json("certify", FOG, "1", *BY, *OVERRIDE_OPTIONS)
    assert (act["verdict"], act["override"], act["objections"][0]["what"]) == ("ambiguous", True, "verdict")
    shown = lab.run("certifications", FOG).stdout
    assert f"certify version 1  A. Person: {REASON}" in shown
    assert "verdict: ambiguous (recording 1" in shown
    assert "overridden: the verdict on recording 1 is 'ambiguous'" in shown
    assert lab.json("audit", "verify")["ok"] is True


@pytest.mark.slow
def test_a_version_worse_than_its_parent_or_than_the_one_in_force_is_refused(lab: Lab) -> None:
    lab.run("fit", FOG, "--effects", "bias,scale_factor,scale_factor_odd")
    lab.run("improve", FOG, "--remove", "scale_factor_odd")
    said = lab.run("certify", FOG, "2", *BY, "--reason", "fits", status=2).stderr
    assert "version 1, from which it was made" in said
    assert "certify version 1, or improve this version" in said
    lab.run("fit", FOG, "--model", "ojeda2000")
    in_force = lab.json("certify", FOG, "3", *BY, "--reason", "fits")
    said = lab.run("certify", FOG, "2", *BY, "--reason", "fits", status=2).stderr
    left_out = f"{in_force['error']['heldout_rms_dps']:.4g} deg/s of version 3"
    assert f"is larger than the {left_out}, which is in force, on the same recording" in said


def test_a_table_of_coefficients_has_no_verdict_and_a_reason(lab: Lab) -> None:
    lab.run("import", str(EXAMPLES / "weiss-gyrostar"))
    lab.run("fit", TABLE, "--model", "weiss1995")
    act = lab.json("certify", TABLE, "1", *BY, "--reason", "published")
    assert (act["verdict"], act["verdict_at"], act["override"]) == (None, None, False)
    assert act["verdict_reason"] == "recording 2 is a table of coefficients and has no measurements to compare with"
    assert "verdict: none: recording 2 is a table" in lab.run("certifications", TABLE).stdout


@pytest.mark.slow
def test_data_that_are_certainly_wrong_speak_against_their_version(lab: Lab, tmp_path: Path) -> None:
    write_recording(spoilt(to_points(single_axis(1)), scaled(-1.0, "gyro_z")), tmp_path / "wrong")
    lab.run("import", str(tmp_path / "wrong"))
    lab.run("fit", SIMULATED, "--model", "ojeda2000", "--accept-warnings")
    said = lab.run("certify", SIMULATED, "1", *BY, "--reason", "fits", status=2).stderr
    assert "recording 2: axis z: the output decreases when the table turns faster" in said
    assert "and fit again" in said
    act = lab.json("certify", SIMULATED, "1", *BY, *OVERRIDE_OPTIONS)
    assert "data" in {each["what"] for each in act["objections"]}


@pytest.mark.slow
def test_over_http_the_refusal_is_a_conflict_and_the_assessment_says_it_before(tmp_path: Path) -> None:
    with open_client(tmp_path / "lab.sqlite") as client:
        client.post("/api/recordings/example", json={"name": "osu-fog"})
        unit = f"/api/units/{FOG}"
        client.post(f"{unit}/calibrations", json={"effects": ["bias", "scale_factor"]})
        known = client.get(f"{unit}/calibrations/1/assessment").json()
        assert (known["verdict"], known["override_needed"]) == ("ambiguous", True)
        in_use = client.get(f"{unit}/calibrations/1/uncertainty", params={"rate_dps": 10, "temperature_c": 25}).json()[
            "any_axis"
        ]
        assert known["any_axis"] == in_use
        assert in_use["z"]["bound_dps"] is None
        path = f"{unit}/calibrations/1/certify"
        refused = client.post(path, json={"by": "A", "reason": "fits"})
        assert (refused.status_code, refused.json()["type"]) == (409, "urn:labctl:problem:certification-refused")
        assert known["objections"][0]["text"] in refused.json()["detail"]
        assert "override: true" in refused.json()["detail"]
        short = client.post(path, json={"by": "A", "reason": "fits", "override": True})
        assert (short.status_code, short.json()["type"]) == (400, "urn:labctl:problem:bad-input")
        act = client.post(path, json={"by": "A", **OVERRIDE}).json()
        assert (act["override"], act["verdict"]) == (True, "ambiguous")
        assert act["uncertainty_unknown"] == in_use["z"]["why"] != ""
        assert client.get(f"{unit}/certifications").json() == [act]
        assert client.get(f"{unit}/calibrations/1").json()["certification"] == act
        assert client.get(f"{unit}/calibrations/9/assessment").status_code == 404


def criticism(verdict: str, share_removed: float) -> CriticismResponse:
    named = ["saturation"] if verdict in {"missing", "ambiguous"} else []
    suspect: dict[str, Any] = {
        "effect": "saturation", "probability": 0.5, "p_value": 0.5, "log_bayes_factor": 1.0,
        "share_removed": share_removed, "coefficients": {}, "coefficients_from": "comparison", "parameters": {},
        "physical": True, "plausible": None, "rms_after_dps": None, "heldout_rms_after_dps": None,
        "usual_size": None, "fit_refused": None, "alias_group": ["saturation"], "origin": "sensor",
        "explanation": "", "experiment": "",
    }  # fmt: skip
    error = {"rms_dps": 0.05, "heldout_rms_dps": None, "noise_floor_dps": 0.01, "noise_floor_source": "none"}
    noise = dict.fromkeys(("white_dps", "drift_dps", "drift_tau_s", "vs_datasheet", "static"))
    return CriticismResponse.model_validate({
        "serial": FOG, "version": 1, "recording": 1, "verdict": verdict, "text": ["So it is."],
        "error": {**error, "explained": None, "direct_form_rms_dps": None}, "noise": noise,
        "lack_of_fit": {"statistic": None, "p_value": None}, "where": [], "suspects": [suspect], "named": named,
        "depends_on": [], "not_testable": [], "experiments": [],
    })  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verdict", "share_removed", "refused"),
    [
        ("adequate", 0.0, False), ("missing", 0.9, True), ("unexplained", 0.0, True), ("ambiguous", 0.2, True),
        ("ambiguous", 0.0, False), ("insufficient_data", 0.0, False),
    ],
)  # fmt: skip
def test_which_verdicts_speak_against_a_version(
    lab: Lab, monkeypatch: pytest.MonkeyPatch, verdict: str, share_removed: float, refused: bool
) -> None:
    lab.run("fit", FOG, "--effects", "bias,scale_factor")
    monkeypatch.setattr(assessment, "criticise_unit", lambda *_, **__: criticism(verdict, share_removed))
    with open_store(str(lab.database), write=False) as store:
        known = assess(store, FOG, 1)
    assert (known.verdict, known.override_needed) == (verdict, refused)
    if refused:
        # the figures are those of the version, which the answer has too, and not of its model refitted for the verdict
        stated = f"(RMS error {known.error.rms_dps:.4g} deg/s, on data left out of the fit "
        stated += f"{known.error.heldout_rms_dps:.4g} deg/s, noise "
        assert stated + f"floor {known.error.noise_floor_dps:.4g} deg/s): So it is" in known.objections[0]["text"]


def test_a_version_whose_fit_was_worse_than_none_is_refused(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    lab.run("fit", FOG, "--effects", "bias,scale_factor")
    monkeypatch.setattr(assessment, "criticise_unit", lambda *_, **__: criticism("adequate", 0.0))
    with open_store(str(lab.database), write=True) as store:
        row = store.calibrations.get(FOG, 1)
        worse = {**row.answer["error"], "raw_rms_dps": 104.9, "rms_dps": 109.4}
        spoilt_row = replace(row, answer={**row.answer, "error": worse})
        monkeypatch.setattr(store.calibrations, "get", lambda *_: spoilt_row)
        (objection,) = assess(store, FOG, 1).objections
    assert objection["what"] == "worse"
    assert "residual of the model on the data of the fit is 109.4 deg/s RMS" in objection["text"]
    assert "104.9 deg/s" in objection["text"]


@pytest.mark.slow
def test_the_same_certification_twice_is_said_and_written_once(lab: Lab) -> None:
    lab.run("fit", FOG, "--model", "ojeda2000")
    certify = ("certify", FOG, "1", *BY, "--reason", "fits", "--due-days", "30")
    first, second = lab.json(*certify), lab.json(*certify)
    assert (first["already_in_force"], second["already_in_force"]) == (None, "unchanged")
    assert second["at"] == first["at"]
    assert "was in force already with the same facts; nothing was written" in lab.run(*certify).stdout
    assert len(lab.json("certifications", FOG)) == 1
    assert [each["action"] for each in lab.json("audit", "list")].count("certify") == 1
    other = [
        lab.json("certify", FOG, "1", *changed)["already_in_force"]
        for changed in (
            ("--by", "B. Person", "--reason", "fits", "--due-days", "30"),
            ("--by", "B. Person", "--reason", "fits well", "--due-days", "30"),
            ("--by", "B. Person", "--reason", "fits well", "--due-days", "60"),
        )
    ]
    assert other == ["renewed"] * 3
    lab.run("revoke", FOG, "1", *BY, "--reason", "dropped")
    assert lab.json(*certify)["already_in_force"] is None  # it was not in force
    assert len(lab.json("certifications", FOG)) == 6
