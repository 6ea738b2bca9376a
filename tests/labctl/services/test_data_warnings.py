"""Wrong data are said at import, refused by fit and improve, and stand before a criticism's verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.fitting import ErrorFigures, FitResult, fit
from labctl.recording import Recording, to_points, write_recording
from labctl.services.calibrations import fitting
from labctl.services.calibrations.comparison import worse_than_before, worse_than_raw
from tests.helpers.lab import Lab
from tests.helpers.recordings import Triaxial
from tests.helpers.service import open_client
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.spoilt import at_one_dataset, exchanged, quantised, scaled, spoilt, wrong_rate

FOG = "FOG-0001"


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture
def brought_in(lab: Lab) -> Callable[[Recording], list[dict[str, object]]]:
    """Import a recording and return the warnings of the answer."""

    def bring(recording: Recording) -> list[dict[str, object]]:
        folder = lab.folder / f"in-{len(list(lab.folder.iterdir()))}"
        write_recording(recording, folder)
        return lab.json("import", str(folder))["warnings"]  # type: ignore[no-any-return]

    return bring


@pytest.mark.slow
def test_good_data_have_no_warning_anywhere(lab: Lab, brought_in: Callable[[Recording], list[object]]) -> None:
    assert brought_in(single_axis(1)) == []
    assert lab.json("fit", FOG, "--model", "ojeda2000")["warnings"] == []
    found = lab.json("criticise", FOG)
    assert found["warnings"] == []
    assert found["text"][0] == "Adequate: no effect is missing, the residual is noise."
    improved = lab.json("improve", FOG, "--add", "scale_factor_asymmetry")
    assert [each["said"] for each in improved["warnings"]] == [
        each.said for each in worse_than_before(errors(improved["before"]), errors(improved["error"]))
    ]


@pytest.mark.slow
def test_certainly_wrong_data_are_refused_in_one_line_unless_accepted(
    lab: Lab, brought_in: Callable[[Recording], list[dict[str, object]]]
) -> None:
    (warning,) = brought_in(spoilt(single_axis(1), at_one_dataset(80.0, wrong_rate)))
    assert (warning["what"], warning["severity"]) == ("one_data_set", "certain")
    before = lab.content()
    refused = lab.run("fit", FOG, "--model", "ojeda2000", status=2).stderr
    assert refused.count("\n") == 1
    assert "data set 65, axis z: the rate is given as 60 deg/s, but the output shows 79.8" in refused
    assert "--accept-warnings" in refused
    assert lab.content() == before
    accepted = lab.json("fit", FOG, "--model", "ojeda2000", "--accept-warnings")
    assert [each["what"] for each in accepted["warnings"]] == ["one_data_set"]
    found = lab.json("criticise", FOG)
    assert found["text"][0].startswith("The data are wrong: data set 65")
    assert found["warnings"] == accepted["warnings"]
    assert "improve" not in lab.run("improve", FOG, "--add", "scale_factor_odd", status=2).stdout
    lab.run("improve", FOG, "--add", "scale_factor_odd", "--accept-warnings")


@pytest.mark.slow
def test_probably_wrong_data_are_fitted_with_a_loud_warning(
    lab: Lab, brought_in: Callable[[Recording], list[dict[str, object]]]
) -> None:
    (warning,) = brought_in(spoilt(single_axis(1), quantised(5.0)))
    assert (warning["what"], warning["severity"]) == ("quantised", "likely")
    printed = lab.run("fit", FOG, "--model", "ojeda2000").stdout
    assert printed.startswith("check: axis z")
    assert "steps of 5 deg/s" in printed
    found = lab.json("criticise", FOG)
    assert found["verdict"] == "adequate"
    assert found["text"][0].startswith("Check the data: axis z")


@pytest.mark.slow
def test_a_criticism_that_cannot_be_computed_says_the_data_first(
    lab: Lab, brought_in: Callable[[Recording], list[dict[str, object]]]
) -> None:
    brought_in(spoilt(single_axis(1), scaled(-1.0, "gyro_z")))
    lab.run("fit", FOG, "--model", "ojeda2000", "--accept-warnings")
    refused = lab.run("criticise", FOG, status=2).stderr
    assert "is refused: axis z: the output decreases when the table turns faster" in refused


def test_exchanged_axes_are_refused_and_have_no_inverse(
    lab: Lab, brought_in: Callable[[Recording], list[dict[str, object]]]
) -> None:
    brought_in(spoilt(Triaxial(1).campaign(1), exchanged("gyro_x", "gyro_y")))
    assert "exchange columns gyro_x and gyro_y" in lab.run("fit", "SIM-1", "--model", "yang2018", status=2).stderr
    forced = lab.run("fit", "SIM-1", "--model", "yang2018", "--accept-warnings", status=2).stderr
    assert "cannot be inverted" in forced


@pytest.mark.slow
def test_over_http_the_refusal_is_a_problem_document(tmp_path: Path) -> None:
    folder = tmp_path / "wrong"
    write_recording(spoilt(to_points(single_axis(1)), scaled(np.pi / 180, "gyro_z")), folder)
    with open_client(tmp_path / "lab.sqlite") as client:
        files = [("files", (path.name, path.read_bytes())) for path in sorted(folder.iterdir())]
        assert client.post("/api/recordings", files=files).json()["warnings"][0]["what"] == "unit"
        path = f"/api/units/{FOG}/calibrations"
        refused = client.post(path, json={"model": "ojeda2000"})
        assert refused.status_code == 422
        assert refused.json()["type"].endswith("data-refused")
        assert "near pi/180" in refused.json()["detail"]
        (warning,) = refused.json()["warnings"]
        assert (warning["what"], warning["severity"]) == ("unit", "certain")
        assert warning["text"] in refused.json()["detail"]
        made = client.post(path, json={"model": "ojeda2000", "accept_warnings": True})
        assert made.status_code == 201
        assert made.json()["warnings"][0]["do"].startswith("state rad/s as the unit of this output")
        assert client.get(f"{path}/1").json()["warnings"] == made.json()["warnings"]


@pytest.mark.slow
def test_validity_of_a_stored_recording_is_that_of_its_readings(
    lab: Lab, brought_in: Callable[[Recording], list[dict[str, object]]]
) -> None:
    recording = single_axis(1)
    brought_in(recording)
    warm = recording.columns["temperature_c"]
    for answer in (
        lab.json("fit", FOG, "--model", "ojeda2000"),
        lab.json("improve", FOG, "--add", "scale_factor_asymmetry"),
    ):
        assert answer["validity"]["temperature_c"] == pytest.approx([warm.min(), warm.max()])
    bias = lab.json("fit", FOG, "--effects", "bias,bias_temperature")
    assert bias["validity"]["rate_dps"] == [None, None]
    assert "any rate" in lab.run("fit", FOG, "--effects", "bias").stdout


def errors(answer: dict[str, Any]) -> ErrorFigures:
    return ErrorFigures(*(answer[name] for name in ("raw_rms_dps", "rms_dps", "heldout_rms_dps", "noise_floor_dps")))


def figures(raw: float, left: float, held_out: float | None = None) -> ErrorFigures:
    return ErrorFigures(raw, left, held_out, None)


def test_a_fit_that_is_worse_than_none_is_certainly_wrong() -> None:
    assert worse_than_raw(figures(2.0, 1.99)) == []
    assert worse_than_raw(figures(2.0, 2.0 * (1 + 1e-9))) == []
    (little,) = worse_than_raw(figures(2.0, 2.01))
    (much,) = worse_than_raw(figures(104.9, 109.4))
    assert (little.severity, much.severity) == ("certain", "certain")
    assert "residual of the model on the data of the fit is 109.4 deg/s RMS" in much.text


@pytest.mark.slow
def test_a_fit_that_is_worse_than_none_is_refused_with_its_figures_and_not_kept(
    lab: Lab, brought_in: Callable[[Recording], list[object]], monkeypatch: pytest.MonkeyPatch
) -> None:
    brought_in(single_axis(1))

    def worse_fit(*arguments: Any, **options: Any) -> FitResult:
        result = fit(*arguments, **options)
        return replace(result, error=replace(result.error, raw_rms_dps=104.9, rms_dps=109.4))

    monkeypatch.setattr(fitting, "fit", worse_fit)
    before = lab.content()
    refused = lab.run("fit", FOG, "--model", "ojeda2000", status=2).stderr
    assert "the residual of the model on the data of the fit is 109.4 deg/s RMS" in refused
    assert "the error without correction is only 104.9 deg/s" in refused
    assert "--accept-warnings" in refused
    assert lab.content() == before
    accepted = lab.json("fit", FOG, "--model", "ojeda2000", "--accept-warnings")
    assert [each["what"] for each in accepted["warnings"]] == ["worse"]


@pytest.mark.slow
def test_an_improvement_that_does_not_predict_better_says_so_loudly(
    lab: Lab, brought_in: Callable[[Recording], list[object]]
) -> None:
    brought_in(single_axis(1))
    lab.run("fit", FOG, "--effects", "bias,scale_factor,bias_temperature:2")
    printed = lab.run("improve", FOG, "--remove", "bias_temperature").stdout
    rises = "the RMS error on data left out of the fit rises"
    assert printed.startswith(f"check: change: {rises}: 0.349 deg/s before, 0.3512 deg/s after")
    stored = lab.json("improve", FOG, "--version", "1", "--remove", "bias_temperature")
    assert [each["where"] for each in stored["warnings"]] == ["change"]


def test_a_change_that_makes_held_out_temperatures_worse_is_said() -> None:
    assert worse_than_before(figures(1, 0.036, 0.036), figures(1, 0.03, 0.035)) == []
    (worse,) = worse_than_before(figures(1, 0.036, 0.036), figures(1, 0.03, 0.134))
    assert worse.severity == "likely"
    assert "the RMS error on data left out of the fit rises: 0.036 deg/s before, 0.134 deg/s after" in worse.text
    (same,) = worse_than_before(figures(1, 0.036, 0.036), figures(1, 0.03, 0.036))
    assert "the RMS error on data left out of the fit does not fall" in same.text
