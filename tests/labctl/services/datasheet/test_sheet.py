"""Performance sheets of units whose characteristics are known, beside witnesses computed from the unit itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from labctl.answers.datasheet import Characteristic, DatasheetResponse
from labctl.cli.app import app
from labctl.errors import BadInput, NotFound
from labctl.fitting import fit
from labctl.fitting.characteristics.scale_factor import changes_with_temperature
from labctl.fitting.data.fit_data import fit_data_of
from labctl.recording import Recording, read_recording
from labctl.services.datasheet.measured import figures_of
from labctl.services.datasheet.sheet import LINES, datasheet, decided
from labctl.services.recordings.examples import example
from labctl.store import Store, open_store
from tests.helpers.recordings import STARTED, Triaxial
from tests.helpers.service import add_recording, open_client

SHEET = {
    "bias_stability_dps": 0.01, "bias_dps": 1.0, "scale_factor_nonlinearity_ppm": 1e-3, "orthogonality_deg": 0.05,
    "bandwidth_hz": 50.0,
}  # fmt: skip
G_DPS = 0.02


def specified(recording: Recording) -> Recording:
    return replace(recording, info=recording.info.model_copy(update={"datasheet": SHEET}))


def six_faces(unit: Triaxial, campaign: Recording) -> Recording:
    """Return rests on six faces, twice each; x changes by `G_DPS` per g along z."""
    faces = ["x", "-x", "y", "-y", "z", "-z"] * 2
    bias = unit.bias(25.0)
    noise = np.random.default_rng(5).normal(0, 1e-4, (3, 12))
    up_z = np.array([{"z": 1.0, "-z": -1.0}.get(face, 0.0) for face in faces])
    outputs = {f"gyro_{axis}": bias[i] + noise[i] for i, axis in enumerate("xyz")}
    outputs["gyro_x"] = outputs["gyro_x"] + G_DPS * up_z
    columns = {
        "dataset": np.arange(1, 13), "t_s": np.arange(12) * 400.0, "position": np.array(faces), "run": np.ones(12, int),
        "table_rate_dps": np.zeros(12), "temperature_c": np.full(12, 25.0), **outputs,
    }  # fmt: skip
    info = campaign.info.model_copy(update={"latitude_deg": None, "motion": "rates"})
    return Recording(info, columns)


@pytest.fixture(scope="module")
def unit() -> Triaxial:
    return Triaxial(2)


@pytest.fixture(scope="module")
def measured(unit: Triaxial) -> Recording:
    return specified(unit.campaign(2))


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


@pytest.fixture
def store(location: str, measured: Recording, unit: Triaxial) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        opened.recordings.add_import(six_faces(unit, measured), STARTED)
        opened.recordings.add_import(measured, STARTED)
        yield opened


@pytest.fixture
def sheet(store: Store, measured: Recording) -> DatasheetResponse:
    return datasheet(store, measured.info.serial)


def lines(sheet: DatasheetResponse, name: str) -> dict[str, Characteristic]:
    return {each.axis + each.along: each for each in sheet.characteristics if each.id == name}


def usual_c(sheet: DatasheetResponse) -> float:
    """Return the level nearest to 25 deg C: 20 or 30, as the noise of the thermometer decides."""
    under = lines(sheet, "scale_factor")["x"].conditions
    assert under is not None
    assert under.temperature_c is not None
    return float(round(under.temperature_c[0] / 10) * 10)


def within(found: Characteristic, expected: float, *, factor: float = 4.0) -> bool:
    assert found.value is not None
    assert found.u is not None
    return abs(found.value - expected) < factor * found.u


def test_alignment_is_that_of_the_unit(sheet: DatasheetResponse, unit: Triaxial) -> None:
    rotation, symmetric = polar(unit.k(usual_c(sheet)), side="left")
    turned = -Rotation.from_matrix(rotation).as_rotvec(degrees=True)
    for i, axis in enumerate("xyz"):
        assert within(lines(sheet, "misalignment")[axis], turned[i])
    rows = symmetric / np.linalg.norm(symmetric, axis=1, keepdims=True)
    expected = np.rad2deg(np.arcsin([rows[0] @ rows[1], rows[0] @ rows[2], rows[1] @ rows[2]]))
    found = lines(sheet, "orthogonality")
    assert all(within(found[pair], each) for pair, each in zip(("xy", "xz", "yz"), expected, strict=True))


def test_scale_factor_and_its_sensitivity_are_those_of_the_unit(sheet: DatasheetResponse, unit: Triaxial) -> None:
    for i, axis in enumerate("xyz"):
        assert within(lines(sheet, "scale_factor")[axis], unit.k(usual_c(sheet))[i, i])
        per_c = unit.slope[i] / unit.k(usual_c(sheet))[i, i] * 1e6
        assert within(lines(sheet, "scale_factor_temperature")[axis], per_c)


def test_g_sensitivity_is_from_the_recording_on_six_faces(sheet: DatasheetResponse) -> None:
    found = lines(sheet, "g_sensitivity")
    assert len(found) == 9
    assert within(found["xz"], G_DPS)
    assert within(found["yz"], 0.0)
    assert found["xz"].conditions is not None
    assert (found["xz"].conditions.recording, found["xz"].conditions.datasets) == (1, 12)
    assert sheet.recordings == [1, 2]


def test_a_recording_at_rest_gives_no_scale_factor_and_no_alignment(measured: Recording, unit: Triaxial) -> None:
    still = six_faces(unit, measured)
    info = still.info.model_copy(update={"latitude_deg": 48.0})  # the Earth's rate differs from face to face
    found = {each.id for each in figures_of(fit_data_of(replace(still, info=info)))}
    assert found == {"bias", "g_sensitivity"}


def test_noise_is_in_the_units_of_the_specification(store: Store, measured: Recording) -> None:
    rng = np.random.default_rng(4)
    n, rate_hz, white = 4000, 10.0, 0.01
    columns = {
        "dataset": np.ones(n, int), "t_s": np.arange(n) / rate_hz, "position": np.full(n, "z"),
        "run": np.ones(n, int), "table_rate_dps": np.zeros(n), "temperature_c": np.full(n, 25.0),
        **{f"gyro_{axis}": rng.normal(0.1, white * np.sqrt(rate_hz), n) for axis in "xyz"},
    }  # fmt: skip
    info = measured.info.model_copy(update={"kind": "samples", "sample_rate_hz": rate_hz})
    store.recordings.add_import(Recording(info, columns), STARTED)
    found = lines(datasheet(store, measured.info.serial), "angle_random_walk")["x"]
    assert found.unit == "deg/s/sqrt(Hz)"
    assert found.value == pytest.approx(white, rel=0.1)


def test_what_is_specified_is_decided_by_simple_acceptance(sheet: DatasheetResponse) -> None:
    linear = lines(sheet, "scale_factor_nonlinearity")["x"]
    assert (linear.passed, linear.near_limit) == (
        False,
        linear.value is not None and linear.value < 2 * (linear.u or 0),
    )
    assert lines(sheet, "bias")["x"].passed is True
    skewed = lines(sheet, "orthogonality")["xy"]
    assert skewed.value is not None
    assert skewed.passed is (abs(skewed.value) <= SHEET["orthogonality_deg"])
    assert sheet.passed is False
    assert any("Scale factor nonlinearity" in text for text in sheet.text)


@pytest.mark.parametrize(("at_most", "passed"), [(0.001, True), (0.004, None), (None, None)])
def test_a_bound_decides_only_below_the_specified_value(at_most: float | None, passed: bool | None) -> None:
    line = next(each for each in LINES if each.id == "bias_instability")
    found = Characteristic(
        id=line.id, title=line.title, axis="x", value=None, u=None, at_most=at_most, unit=line.unit, conditions=None,
        specified=None, specified_as="at most", passed=None,
    )  # fmt: skip
    assert decided(line, found, 0.003).passed is passed


def test_what_is_not_measured_is_null_and_names_its_recipe(sheet: DatasheetResponse) -> None:
    wide = lines(sheet, "bandwidth")[""]
    assert (wide.value, wide.passed, wide.specified, wide.specified_as) == (None, None, 50.0, "at least")
    assert wide.why.startswith("not measured: recipe sine-dwell or sweeps")
    assert "turn-on-20" in lines(sheet, "bias_repeatability")[""].why
    assert "static-night" in lines(sheet, "angle_random_walk")[""].why
    assert {"bandwidth", "bias_repeatability", "angle_random_walk"} <= set(sheet.not_measured)


def test_a_unit_without_recordings_or_unknown_is_refused(store: Store) -> None:
    with pytest.raises((NotFound, BadInput)):
        datasheet(store, "nothing")


def test_command_line_and_http_say_the_same(tmp_path: Path, location: str, store: Store, measured: Recording) -> None:
    serial = measured.info.serial
    store.close()
    out = tmp_path / "sheet.json"
    answer = CliRunner().invoke(app, ["datasheet", serial, "--json", "--out", str(out), "--database", location])
    assert answer.exit_code == 1  # a specified value is not kept
    said = DatasheetResponse.model_validate_json(answer.stdout)
    assert DatasheetResponse.model_validate_json(out.read_text()) == said
    with open_client(tmp_path / "other.sqlite") as client:
        add_recording(client, measured)
        found = DatasheetResponse.model_validate(client.get(f"/api/units/{serial}/datasheet").json())
    assert lines(found, "bias").keys() == lines(said, "bias").keys()
    assert lines(found, "scale_factor")["x"].value == lines(said, "scale_factor")["x"].value


def test_temperatures_that_are_no_levels_give_the_changes_with_temperature() -> None:
    data = fit_data_of(read_recording(example("osu-fog")))
    assert data.levels is None
    found = {figure.id: figure for figure in figures_of(data)}
    bias, scale = found["bias_temperature"].estimate, found["scale_factor_temperature"].estimate
    assert np.count_nonzero(found["bias_temperature"].rows) == len(data)
    (fitted,) = fit(read_recording(example("osu-fog")), "bias_scale", []).to_json()["axes"].values()
    for estimate, name, factor in ((bias, "bias_t1", 1.0), (scale, "scale_factor_t1", 1e6)):
        coefficient = fitted["coefficients"][name]
        assert isinstance(coefficient, dict)
        assert isinstance(coefficient["value"], float)
        assert estimate.u is not None
        assert abs(estimate.value - factor * coefficient["value"]) < 3 * estimate.u, name


def test_the_change_with_temperature_of_a_known_output_is_found() -> None:
    rng = np.random.default_rng(4)
    rate, warm_c = rng.uniform(-100, 100, 200), rng.uniform(20, 40, 200)
    output = 0.1 + 0.003 * (warm_c - 30) + rate * (1.001 - 2e-5 * (warm_c - 30)) + rng.normal(0, 0.001, 200)
    found = changes_with_temperature(rate, warm_c, output)
    assert found is not None
    for estimate, known in zip(found, (0.003, -2e-5), strict=True):
        assert estimate.u is not None
        assert abs(estimate.value - known) < 4 * estimate.u < 0.05 * abs(known)


def test_rates_that_rise_with_the_temperature_tell_no_change() -> None:
    rate = np.linspace(-100, 100, 200)
    assert changes_with_temperature(rate, 30 + rate / 20, rate) is None
    assert changes_with_temperature(rate, 30 + rate / 500, rate) is None  # 0.4 K are one temperature


def test_each_figure_states_how_it_is_computed_and_to_what_it_is_relative(sheet: DatasheetResponse) -> None:
    assert all(each.definition for each in sheet.characteristics)
    for each in lines(sheet, "scale_factor").values():
        assert each.definition.startswith("slope of the best straight line through the output over the true rate")
        assert each.definition.endswith("(scale factor 1 deg/s per deg/s, 0 deg/s at rest)")
    assert "differs from the coefficient of the same name where the model has further effects" in sheet.basis
