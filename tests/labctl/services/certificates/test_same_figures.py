"""One quantity, one figure: certificate (JSON, XML, page), data sheet, C header and answer of a tri-axial unit."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.calibration import read_calibration
from labctl.certificates.document import Certificate
from labctl.certificates.readable import readable_certificate
from labctl.exports import export_calibration
from labctl.recording import to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.served import calibration_file
from labctl.services.calibrations.uncertainty import uncertainty_answer
from labctl.services.certificates.issue import issue
from labctl.services.datasheet.sheet import datasheet
from labctl.store import Store, open_store
from tests.helpers.certificates import AT, request
from tests.helpers.simulated_recordings import three_axes

SERIAL = "STIM-0001"
LIMIT_DPS = 3.0
EFFECTS = ["bias", "bias_temperature:3", "scale_factor", "scale_factor_temperature:2", "misalignment"]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    path = tmp_path_factory.mktemp("figures") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        opened.recordings.add_import(to_points(three_axes()), AT)
        fit_unit(opened, SERIAL, FitRequest(effects=EFFECTS), AT)
        opened.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="meets the criteria", at=AT)
        conformity = {"specification": "S", "limit_dps": LIMIT_DPS, "rule": "guard-band"}
        issue(opened, SERIAL, 1, request(conformity=conformity), AT)
        yield opened


@pytest.fixture(scope="module")
def documents(store: Store) -> dict[str, Any]:
    number = store.certificates.newest(SERIAL, 1)
    assert number is not None
    forms, content = store.certificates.forms(number.number), store.calibrations.document(SERIAL, 1)[0]
    calibration = read_calibration(content)
    reference_c = calibration.fitted.model.reference.temperature_c
    stored = calibration.document["uncertainty"]
    return {
        "json": json.loads(forms.document),
        "page": json.loads(readable_certificate(Certificate.model_validate_json(forms.document))),
        "xml": ET.fromstring(forms.xml),
        "header": export_calibration(content, "c")[0].decode(),
        "stored": stored,
        "at_stored": uncertainty_answer(calibration, [50.0], stored["coefficients_at_c"]).model_dump(mode="json"),
        "answer": uncertainty_answer(calibration, [50.0], reference_c).model_dump(mode="json"),
        "sheet": datasheet(store, SERIAL).model_dump(mode="json"),
    }


@pytest.mark.parametrize("name", ["c", "python", "px4"])
def test_one_hash_names_the_calibration(store: Store, documents: dict[str, Any], name: str) -> None:
    """A file that is served carries the certification, and a hash over that too; certificate and header name one."""
    content = calibration_file(store, SERIAL, 1, "json").content
    written = calibration_file(store, SERIAL, 1, name).content.decode()
    assert documents["json"]["calibration"]["hash"] in written
    assert json.loads(content)["hash"] not in written


def largest(documents: dict[str, Any], frame: str) -> float:
    return max(float(one["vector"][frame]) for one in documents["stored"]["axes"].values())


def test_u_about_any_axis_is_one_figure(documents: dict[str, Any]) -> None:
    for axis, one in documents["stored"]["axes"].items():
        vector = one["vector"]
        served = documents["answer"]["any_axis"][axis]
        printed = next(each for each in documents["json"]["any_axis"] if each["output"] == axis)
        assert served["bound_dps"] == printed["expanded_dps"] == vector["bound_dps"]
        assert served["aligned_bound_dps"] == printed["aligned_expanded_dps"] == vector["aligned_bound_dps"]
        row = next(row for row in documents["page"]["any_axis"] if row[0] == axis)
        for text, value in zip(row[1:3], (vector["bound_dps"], vector["aligned_bound_dps"]), strict=True):
            assert value <= float(text) <= 1.1 * value
    header = documents["header"]
    constants = re.search(r"_u_any_axis_dps\[3\] = \{([^}]*)\}", header)
    assert constants is not None
    for text, one in zip(constants[1].split(","), documents["stored"]["axes"].values(), strict=True):
        assert one["vector"]["bound_dps"] <= float(text) <= 1.1 * one["vector"]["bound_dps"]
        assert f"{float(text):g} deg/s" in header.partition("U turned about any axis")[2].partition("\n *  ")[0]


def test_conformity_is_decided_by_the_same_u(documents: dict[str, Any]) -> None:
    stated = documents["json"]["conformity"]
    bound = largest(documents, "bound_dps")
    assert stated["expanded_dps"] == bound
    assert stated["guard_band_dps"] == stated["guard_band_factor"] * bound
    assert stated["acceptance_dps"] == LIMIT_DPS - stated["guard_band_dps"]
    assert f"w = {stated['guard_band_factor']:.3g} U" in stated["statement"]
    assert f"U = {bound:.3g} °/s" in stated["statement"]
    declared = ET.tostring(documents["xml"], encoding="unicode")
    assert stated["statement"] in declared.replace("&#8722;", "−")
    assert documents["page"]["conformity"]["statement"] == stated["statement"]


@pytest.mark.parametrize("name", ["scale_factor", "misalignment_x", "misalignment_y", "misalignment_z"])
def test_u_of_a_coefficient_is_that_of_its_budget(documents: dict[str, Any], name: str) -> None:
    found = [each for each in documents["json"]["coefficients"] if each["name"] == name]
    assert found
    for each in found:
        budget = documents["answer"]["coefficients"][each["axis"]][name]
        assert each["has_standards"]
        assert each["u"] == pytest.approx(budget["combined"], rel=1e-9)
        assert each["value"] == pytest.approx(budget["value"], rel=1e-6)
        stored = documents["stored"]["axes"][each["axis"]]["coefficients"][name]
        at_stored = documents["at_stored"]["coefficients"][each["axis"]][name]
        assert stored["combined"] == pytest.approx(at_stored["combined"], rel=1e-6)


def test_the_data_sheet_knows_the_mountings_too(documents: dict[str, Any]) -> None:
    """Its misalignment is a rotation in degrees: each angle is half the difference of two entries of the matrix."""
    u = documents["answer"]["coefficients"]
    lines = {each["axis"]: each["u"] for each in documents["sheet"]["characteristics"] if each["id"] == "misalignment"}
    entries = {"x": ("y", "z"), "y": ("x", "z"), "z": ("x", "y")}
    for axis, (one, other) in entries.items():
        pair = [u[one][f"misalignment_{other}"]["combined"], u[other][f"misalignment_{one}"]["combined"]]
        assert lines[axis] == pytest.approx(math.degrees(math.hypot(*pair) / 2), rel=0.1)


def test_no_u_is_smaller_than_that_of_the_mountings(documents: dict[str, Any]) -> None:
    """A certificate printed 3e-6 for a misalignment whose fixture is known to 2e-4."""
    stated = [each for each in documents["answer"]["budget"]["x"]["lines"] if each["source"] == "fixture_angle"]
    u_rad = np.radians(stated[0]["u"])
    for each in documents["json"]["coefficients"]:
        if each["name"].startswith("misalignment"):
            assert each["u"] > u_rad


def printed_number(text: str) -> float:
    """Return a number of a page: −5.583 × 10⁻⁷, 0.0087 × 10⁻⁷ *."""
    plain = text.rstrip(" *").replace(" × 10", "e").translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789"))
    return float(plain)


def test_the_page_prints_what_the_document_says(documents: dict[str, Any]) -> None:
    for row, each in zip(documents["page"]["coefficients"], documents["json"]["coefficients"], strict=True):
        factor = {"mrad": 1e3, "ppm": 1e6, "%": 1e2}.get(re.split("[ /]", row[5])[0], 1.0)
        value, u = (printed_number(text) / factor for text in row[3:5])
        assert (row[5] == "mrad") == each["name"].startswith("misalignment")
        assert each["u"] <= u <= 1.1 * each["u"]
        assert value == pytest.approx(each["value"], abs=u)
    points = {(str(table["axis"]), *row[:2]): row for table in documents["page"]["results"] for row in table["rows"]}
    assert len(points) == len(documents["json"]["results"])
    for each in documents["json"]["results"]:
        key = (each["axis"], *(f"{each[name]:.4g}".replace("-", "−") for name in ("temperature_c", "rate_dps")))
        row = points[key]
        assert each["expanded_dps"] <= float(row[3]) <= 1.1 * each["expanded_dps"]
        assert float(row[2].replace("−", "-")) == pytest.approx(each["error_dps"], abs=float(row[3]))
