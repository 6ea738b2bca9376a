"""Accelerometer and magnetometer on a certificate: converted to the stated reference, with U, in all three forms."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dcclib.validation import SchematronValidator

from labctl.answers.certificates import OrderedAccelerometer
from labctl.answers.sensors import AccelerometerRequest, MagnetometerRequest
from labctl.certificates.document import Certificate, SensorResult
from labctl.certificates.readable import readable_certificate
from labctl.errors import BadInput, NotFound
from labctl.fitting.numeric.degrees_of_freedom import student_factor
from labctl.recording.files import write_recording
from labctl.services.accelerometer import Source as ForceSource
from labctl.services.accelerometer import accelerometer_of_files
from labctl.services.certificates.issue import issue
from labctl.services.certificates.missing import MissingFacts
from labctl.services.certificates.sensors import accelerometer_result
from labctl.services.magnetometer import Source as FieldSource
from labctl.services.magnetometer import magnetometer_of_file
from labctl.services.sensor_versions import keep_accelerometer, keep_magnetometer, measured_data, one_accelerometer
from labctl.store import Store, open_store
from studies.accelerometer_simulation import TrueUnit, poses_at_temperatures
from studies.poses import turned_deg
from studies.poses_simulation import Session, simulate_session
from studies.triads_simulation import vector_of
from tests.helpers.certificates import AT, SERIAL, add_version, request
from tests.helpers.magnetic_turns import FIELD_UT, HARD_IRON_UT, SOFT_IRON, fields, readings_of
from tests.helpers.poses_at_rest import BIAS_G, ERRORS, poses, readings_in, write_readings
from tests.helpers.turned_triads import unit_of, write_turned

STANDARD = 9.80665
#: Gravity where the readings below were made, and how well it is known, m/s2.
LOCAL, LOCAL_U = 9.83, 0.005
ACCELEROMETER: dict[str, Any] = {
    "version": 1, "performed_from": "2026-01-05", "gravity_m_s2": LOCAL, "gravity_u_m_s2": LOCAL_U,
    "traceability": "gravity information system",
}  # fmt: skip
MAGNETOMETER: dict[str, Any] = {"version": 1, "performed_from": "2026-01-05"}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    folder = tmp_path_factory.mktemp("sensors")
    with open_store(str(folder / "lab.sqlite"), write=True) as opened:
        add_version(opened)
        keep_force(opened, folder)
        keep_field(opened, folder / "m.csv", readings_of(fields(800), 1))
        yield opened


def keep_force(store: Store, folder: Path) -> None:
    local = (readings_in(poses(26, 1), 1)[:, 1:] - BIAS_G) * LOCAL / STANDARD + BIAS_G
    timed = np.column_stack([np.arange(len(local)) / 50.0, local])
    path = Path(write_readings(folder / "a.csv", timed))
    source = ForceSource()
    found = accelerometer_of_files([path], source)
    data = measured_data([path], source.text)
    keep_accelerometer(store, SERIAL, AccelerometerRequest(data=data, result=found, by="Ada"), AT)


def keep_field(store: Store, path: Path, readings: np.ndarray, field_ut: float | None = None) -> None:
    np.savetxt(path, readings, delimiter=",", header="mag_x,mag_y,mag_z", comments="")
    source = FieldSource(field_ut=field_ut)
    data = measured_data([path], source.text)
    found = magnetometer_of_file(path, source)
    keep_magnetometer(store, SERIAL, MagnetometerRequest(data=data, result=found, by="Ada"), AT)


def sensors_of(store: Store, **parts: Any) -> tuple[Certificate, tuple[SensorResult, ...]]:
    made = issue(store, SERIAL, add_version(store), request(**parts), AT)
    given = Certificate.model_validate_json(store.certificates.forms(made.number).document)
    return given, given.sensors


def test_the_scale_factors_are_those_of_the_local_gravity_that_is_stated(store: Store) -> None:
    _, (found,) = sensors_of(store, accelerometer=ACCELEROMETER)
    by_name = {each.name: each for each in found.coefficients}
    for i, axis in enumerate("xyz"):
        bias, scale = by_name[f"bias {axis}"], by_name[f"scale factor {axis}"]
        assert abs(bias.value - STANDARD * BIAS_G[i]) < 1.5 * bias.expanded
        assert abs(scale.value - ERRORS[i, i]) < 1.5 * scale.expanded
        assert scale.u > (1 + ERRORS[i, i]) * LOCAL_U / LOCAL  # the fit cannot be better than gravity is known
        assert scale.expanded == pytest.approx(scale.k * scale.u)
    assert abs(by_name["misalignment xy"].value - ERRORS[0, 1]) < 1.5 * by_name["misalignment xy"].expanded
    assert by_name["misalignment xy"].u < LOCAL_U / LOCAL
    assert (found.verdict, found.reference.u, found.included_by) == ("adequate", LOCAL_U, "I. Issuer")
    assert "took the local gravity as 9.80665 m/s²" in found.found[-1]
    assert "other temperatures" in found.not_stated


@pytest.mark.slow
def test_a_magnetometer_without_a_stated_field_is_relative_and_says_so(store: Store) -> None:
    _, (found,) = sensors_of(store, magnetometer=MAGNETOMETER)
    assert found.reference.u is None
    assert found.reference.traceability.startswith("none: the soft iron is relative")
    absolute = {"field_ut": FIELD_UT, "field_u_ut": 0.24, "traceability": "proton magnetometer, certificate M-3"}
    _, (stated,) = sensors_of(store, magnetometer=MAGNETOMETER | absolute)
    soft = {each.name: each for each in stated.coefficients}
    for i, axis in enumerate("xyz"):
        assert abs(soft[f"hard iron {axis}"].value - HARD_IRON_UT[i]) < 1.5 * soft[f"hard iron {axis}"].expanded
        assert abs(soft[f"soft iron {axis}{axis}"].value - SOFT_IRON[i, i]) < 0.25 * 0.01
        assert soft[f"soft iron {axis}{axis}"].u > 0.004  # the field is known to 0.5 %
    # a fit that was given another size is converted to the same
    given = store.location
    keep_field(store, Path(given).parent / "given.csv", readings_of(fields(800), 1), field_ut=50.0)
    _, (converted,) = sensors_of(store, magnetometer=MAGNETOMETER | absolute | {"version": 2})
    for one, other in zip(stated.coefficients, converted.coefficients, strict=True):
        assert (one.value, one.u) == pytest.approx((other.value, other.u), rel=1e-4, abs=1e-7)


def test_all_three_forms_state_both(store: Store) -> None:
    made = issue(store, SERIAL, add_version(store), request(accelerometer=ACCELEROMETER, magnetometer=MAGNETOMETER), AT)
    forms = store.certificates.forms(made.number)
    given = Certificate.model_validate_json(forms.document)
    page = json.loads(readable_certificate(given))
    assert [each["title"] for each in page["sensors"]] == ["Accelerometer, version 1", "Magnetometer, version 1"]
    assert [len(each["rows"]) for each in page["sensors"]] == [9, 9]
    assert forms.pdf.startswith(b"%PDF-1.7")
    xml = forms.xml.decode()
    for said in ("Accelerometer, version 1", "scale factor x", "soft iron yz", "gravity information system",
                 r"\metre\second\tothe{-2}", r"\micro\tesla"):  # fmt: skip
        assert said in xml, said
    found = SchematronValidator.for_dcc().validate_str(xml)
    assert [each.text for each in [*found.failed_assertions, *found.successful_reports]
            if each.role != "information"] == []  # fmt: skip


@pytest.mark.slow
def test_coefficients_of_temperature_are_stated_with_their_range(store: Store, tmp_path: Path) -> None:
    unit = TrueUnit.drawn(np.random.default_rng(5))
    path = tmp_path / "warm.csv"
    head = "t_s,accel_x_g,accel_y_g,accel_z_g,temp_c"
    np.savetxt(path, poses_at_temperatures(1, unit), delimiter=",", header=head, comments="", fmt="%.7f")
    source = ForceSource(temperature="temp_c")
    found = accelerometer_of_files([path], source)
    data = measured_data([path], source.text)
    kept = keep_accelerometer(store, SERIAL, AccelerometerRequest(data=data, result=found, by="Ada"), AT)
    _, (stated,) = sensors_of(store, accelerometer=ACCELEROMETER | {"version": kept.version})
    by_name = {each.name: each for each in stated.coefficients}
    assert len(by_name) == 21
    for i, axis in enumerate("xyz"):
        cubic = by_name[f"bias {axis}, power 3 of temperature"]
        assert (cubic.unit, abs(cubic.value - STANDARD * unit.bias_powers[2, i]) < 1.5 * cubic.expanded) == (
            "m/s^2/K^3", True,
        )  # fmt: skip
    assert "from -10.0 °C to 60.9 °C" in stated.holds_for
    assert "temperatures outside the range" in stated.not_stated


def test_what_the_order_has_to_state_is_named(store: Store) -> None:
    version = add_version(store)
    with pytest.raises(MissingFacts) as refused:
        issue(store, SERIAL, version, request(accelerometer={"version": 1}, magnetometer={
            "version": 1, "performed_from": "2026-01-05", "field_ut": 48.0}), AT)  # fmt: skip
    assert {each.fact for each in refused.value.facts} == {
        "performed_from of the accelerometer", "local gravity (gravity_m_s2)",
        "standard uncertainty of the local gravity (gravity_u_m_s2)", "traceability of the local gravity",
        "field_ut, field_u_ut and traceability together",
    }  # fmt: skip
    with pytest.raises(NotFound, match="has no version 9"):
        issue(store, SERIAL, version, request(accelerometer=ACCELEROMETER | {"version": 9}), AT)
    late = ACCELEROMETER | {"performed_until": "2026-01-04"}
    with pytest.raises(BadInput, match="before performed_from"):
        issue(store, SERIAL, version, request(accelerometer=late), AT)


def test_a_field_that_was_not_constant_is_no_calibration(store: Store, tmp_path: Path) -> None:
    field = fields(800) * (1 + 0.1 * np.sin(np.linspace(0, 25, 800)))[:, None]
    keep_field(store, tmp_path / "disturbed.csv", readings_of(field, 1))
    newest = store.sensor_versions.get(SERIAL, "magnetometer").version
    with pytest.raises(BadInput, match="was not constant"):
        issue(store, SERIAL, add_version(store), request(magnetometer=MAGNETOMETER | {"version": newest}), AT)


@pytest.mark.slow
def test_the_alignment_of_the_gyro_triad_is_stated_with_its_uncertainty(tmp_path: Path) -> None:
    folder = tmp_path / "turned"
    recording, truth = simulate_session(3, Session(rests=22, latitude_deg=48.0))
    write_recording(replace(recording, info=recording.info.model_copy(update={"serial": SERIAL})), folder)
    found = accelerometer_of_files([folder], ForceSource())
    assert found.alignment is not None
    assert "Gyro triad turned from the accelerometer triad about x, y, z by" in found.text[-1]
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        add_version(store)
        data = measured_data([folder], ForceSource().text)
        keep_accelerometer(store, SERIAL, AccelerometerRequest(data=data, result=found, by="Ada"), AT)
        stored = one_accelerometer(store, SERIAL, 1)
        assert stored.result.alignment == found.alignment
    ordered = OrderedAccelerometer.model_validate(ACCELEROMETER)
    stated = {each.name: each for each in accelerometer_result(stored, ordered, "Ada").coefficients}
    for axis, true in zip("xyz", turned_deg(truth.gyro, truth.accel), strict=True):
        each = stated[f"gyro triad about {axis}"]
        assert (each.value, each.unit) == (found.alignment["axes"][axis]["value"], "deg")
        assert abs(each.value - true) < 2 * each.expanded
        assert 0 < each.expanded < 0.03
        fitted = found.alignment["axes"][axis]
        factor = student_factor(fitted["degrees_of_freedom"])
        assert each.expanded == pytest.approx(factor * fitted["u"], rel=1e-4)


@pytest.mark.slow
def test_the_alignment_of_the_magnetometer_is_in_all_three_forms(tmp_path: Path) -> None:
    unit = unit_of(11)
    folder = write_turned(tmp_path / "turned", unit, 20, serial=SERIAL)
    source = FieldSource()
    found = magnetometer_of_file(folder, source)
    assert found.alignment is not None
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        version = add_version(store)
        data = measured_data([folder], source.text)
        keep_magnetometer(store, SERIAL, MagnetometerRequest(data=data, result=found, by="Ada"), AT)
        forms = store.certificates.forms(issue(store, SERIAL, version, request(magnetometer=MAGNETOMETER), AT).number)
    given = Certificate.model_validate_json(forms.document)
    (stated,) = given.sensors
    by_name = {each.name: each for each in stated.coefficients}
    for axis, true in zip("xyz", np.degrees(vector_of(unit.turned)), strict=True):
        each, fitted = by_name[f"magnetometer about {axis}"], found.alignment["axes"][axis]
        assert (each.value, each.unit) == (fitted["value"], "deg")
        assert each.expanded == pytest.approx(student_factor(fitted["degrees_of_freedom"]) * fitted["u"], rel=1e-4)
        assert abs(each.value - true) < 2 * each.expanded
    assert "rotation vector from the axes of the corrected force" in stated.formula
    (page,) = json.loads(readable_certificate(given))["sensors"]
    assert len(page["rows"]) == 12
    assert forms.pdf.startswith(b"%PDF-1.7")
    xml = forms.xml.decode()
    assert "magnetometer about y" in xml
    assert r"\degree" in xml
    checked = SchematronValidator.for_dcc().validate_str(xml)
    assert [each.text for each in [*checked.failed_assertions, *checked.successful_reports]
            if each.role != "information"] == []  # fmt: skip


def test_a_recording_whose_turns_do_not_tell_the_alignment_says_so(tmp_path: Path) -> None:
    recording, _ = simulate_session(3, Session(rests=22, latitude_deg=48.0, full_scale_dps=40.0))
    write_recording(recording, tmp_path / "turned")
    found = accelerometer_of_files([tmp_path / "turned"], ForceSource())
    assert found.alignment is None
    assert found.text[-1].startswith("Alignment of the gyro triad: unknown: HAND-1: ")
