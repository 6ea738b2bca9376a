"""One quantity, one figure: every number that stands in two documents, side by side, for three units.

Certificate as JSON, DCC and printed pages, the C header, the calibration file, the command `labctl uncertainty`, and
HTTP. A printed U is rounded up to two digits, a printed value to the place of its U.
"""

from __future__ import annotations

import json
import math
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from fastapi.testclient import TestClient
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.answers.certificates import CertificateOrder, CertificateRequest
from labctl.api.app import create_app
from labctl.certificates.document import Certificate
from labctl.certificates.readable import readable_certificate
from labctl.cli.app import app
from labctl.recording import to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.served import calibration_file
from labctl.services.certificates.issue import issue
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import Store, open_store
from procedures.planning.plan import make_plan
from procedures.recipe.rules import Verification

AT = datetime(2027, 3, 1, 12, tzinfo=UTC)
NAMES = ("json", "dcc", "pages", "file", "header", "command", "http")
ORDER: dict[str, Any] = {
    "laboratory": {
        "name": "L", "street": "S 1", "post_code": "1", "city": "C", "country": "DE", "email": "l@example.org",
        "procedure": "P-1", "number_prefix": "L-",
    },
    "customer": {
        "name": "C", "street": "S 2", "post_code": "2", "city": "C", "country": "DE", "email": "c@example.org",
    },
    "item": {"manufacturer": "M", "condition": "good"}, "method": {"name": "rate sweep"},
}  # fmt: skip

#: Units of printed numbers that are parts of 1, and of rad: how they begin.
PARTS = {"mrad": 1e-3, "ppm": 1e-6, "%": 1e-2}
#: Raised digits of a printed power of ten: × 10⁻⁶.
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


@dataclass(frozen=True)
class Unit:
    """A unit: where it is simulated, and what is fitted."""

    serial: str
    recipe: str
    bench: str
    request: FitRequest
    about: str
    verified: bool = False


UNITS = (
    Unit("FOG-0001", "ojeda2000-121", "single-axis-sim", FitRequest(effects=["bias", "scale_factor"]), "own axis"),
    Unit("STIM-0001", "table1-x-table2", "triaxial-sim", FitRequest(model="yang2018"), "any axis"),
    Unit("STIM-0002", "table1-x-table2", "triaxial-sim", FitRequest(effects=[
        "bias", "bias_temperature:3", "scale_factor", "scale_factor_temperature:2", "misalignment"]), "any axis", True),
)  # fmt: skip


@dataclass(frozen=True)
class Printed:
    """A printed number in its unit without a prefix, and how much its last place is."""

    text: str
    value: float
    step: float

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Figure:
    """A quantity, and what each document says of it; a text was printed, and so is rounded."""

    quantity: str
    said: Mapping[str, float | str | Printed]

    @property
    def agrees(self) -> bool:
        """Whether every document says what the JSON says; a DCC has nine digits, a header two of U."""
        exact = self.said["json"]
        assert isinstance(exact, float)
        return all(_is_same(exact, value) for value in self.said.values())


def _is_same(exact: float, said: float | str | Printed) -> bool:
    if isinstance(said, float):
        return abs(said - exact) <= 1e-8 * abs(exact)
    printed = said if isinstance(said, Printed) else printed_in(said)
    return abs(printed.value - exact) <= 1.001 * printed.step


def printed_in(text: str, unit: str = "", beside: str = "") -> Printed:
    """Read a printed number in a unit; its last place is that of the two digits of the uncertainty `beside` it."""
    value, step = _number_in(text)
    if beside.strip("–"):
        u, step = _number_in(beside)
        step = max(step, 10.0 ** (math.floor(math.log10(u)) - 1)) if u else step
    factor = next((each for begin, each in PARTS.items() if unit.startswith(begin)), 1.0)
    return Printed(text, factor * value, factor * step)


def _number_in(text: str) -> tuple[float, float]:
    """Return a printed number and one unit of its last decimal."""
    printed, _, exponent = text.replace("−", "-").rstrip(" *%").partition(" × 10")
    number, _, written = printed.partition("e")
    power = 10.0 ** int(exponent.translate(RAISED) or written or 0)
    return float(number) * power, power * 10.0 ** -len(number.partition(".")[2])


def figures(store: Store, unit: Unit) -> Iterator[Figure]:
    """Yield the quantities of one unit that stand in two documents or more."""
    order = {**ORDER, "conformity": {"specification": "S", "limit_dps": 5.0, "about": unit.about, "rule": "guard-band"}}
    request = CertificateRequest(by="I", order=CertificateOrder.model_validate(order))
    number = issue(store, unit.serial, 1, request, AT).number
    forms = store.certificates.forms(number)
    document, xml = json.loads(forms.document), ET.fromstring(forms.xml)
    pages = json.loads(readable_certificate(Certificate.model_validate_json(forms.document)))
    file = json.loads(calibration_file(store, unit.serial, 1, "json").content)
    header = calibration_file(store, unit.serial, 1, "c").content.decode()
    place = document["results"][0]
    dcc = _dcc_numbers(xml)
    rate, warm = place["rate_dps"], place["temperature_c"]
    command = CliRunner().invoke(app, [
        "uncertainty", unit.serial, f"--rate-dps={rate}", f"--temperature-c={warm}", "--json", "--database",
        store.location,
    ])  # fmt: skip
    said = json.loads(command.stdout)
    with TestClient(create_app(LabService(store, VirtualClock()))) as client:
        path = f"/api/units/{unit.serial}/calibrations/1/uncertainty?rate_dps={rate}&temperature_c={warm}"
        served = client.get(path).json()
    first = pages["results"][0]["rows"][0]
    yield Figure(f"U of axis {place['axis']} at {rate:g} deg/s, {warm:.1f} deg C", {
        "json": place["expanded_dps"], "pages": first[3], "dcc": _nearest(dcc, place["expanded_dps"]),
        "command": said["budget"][place["axis"]]["expanded"], "http": served["budget"][place["axis"]]["expanded"],
    })  # fmt: skip
    yield Figure(
        "error there", {"json": place["error_dps"], "pages": first[2], "dcc": _nearest(dcc, place["error_dps"])}
    )
    for axis, stated in file["uncertainty"]["axes"].items():
        yield from _about_any(axis, stated, document, pages, header, served)
    for row, each in zip(pages["coefficients"], document["coefficients"], strict=True):
        quantity = f"{each['name']} of {each['axis']} at {each['temperature_c'] or 0:.0f}"
        value, u = printed_in(row[3], row[5], row[4]), printed_in(row[4], row[5], row[4])
        yield Figure(quantity, {"json": each["value"], "pages": value, "dcc": _nearest(dcc, each["value"])})
        if each["u"]:
            yield Figure(f"u({quantity})", {"json": each["u"], "pages": u, "dcc": _nearest(dcc, each["u"])})
    yield from _of_conformity(document, pages, dcc)


def _about_any(
    axis: str, stated: Mapping[str, Any], document: Any, pages: Any, header: str, served: Any
) -> Iterator[Figure]:
    """Yield the largest U of an output where the item turns about any axis."""
    place = next((k for k, each in enumerate(document["any_axis"]) if each["output"] == axis), None)
    if place is None or stated["vector"]["bound_dps"] is None:
        return
    constants = re.search(r"_u_any_axis_dps\[\d\] = \{([^}]*)\}", header)
    assert constants is not None
    yield Figure(f"U of {axis}, any axis", {
        "json": document["any_axis"][place]["expanded_dps"], "pages": pages["any_axis"][place][1],
        "file": stated["vector"]["bound_dps"], "header": constants[1].split(",")[place].strip(),
        "http": served["any_axis"][axis]["bound_dps"],
    })  # fmt: skip


def _of_conformity(document: Any, pages: Any, dcc: Sequence[float]) -> Iterator[Figure]:
    """Yield limit, guard band and errors of the statement of conformity."""
    found = document["conformity"]
    text = pages["conformity"]["statement"]
    for name, before in (("acceptance_dps", "acceptance limit of "), ("expanded_dps", ", U = ")):
        said = re.search(rf"{before}([-0-9.e]+)", text)
        assert said is not None
        yield Figure(f"conformity: {name}", {"json": found[name], "pages": said[1], "dcc": _nearest(dcc, found[name])})
    for row, each in zip(pages["conformity"]["results"], found["results"], strict=True):
        yield Figure(f"verified error of {each['output']}", {"json": each["error_dps"], "pages": row[5]})


def _dcc_numbers(root: ET.Element) -> list[float]:
    """Return every number of a DCC."""
    found = []
    for element in root.iter():
        for word in (element.text or "").split():
            try:
                found.append(float(word))
            except ValueError:
                continue
    return found


def _nearest(numbers: Sequence[float], wanted: float) -> float:
    """Return the number of a document that is nearest to one that should be there."""
    return min(numbers, key=lambda number: abs(number - wanted))


def _made(store: Store, unit: Unit) -> None:
    """Simulate, import, fit and certify a unit."""
    recipe = load_recipe(unit.recipe)
    if unit.verified:
        recipe = recipe.model_copy(update={"verification": Verification()})
    bench = load_bench(unit.bench)
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": 2.0, "serial": unit.serial})
    recording = hidden_recording(make_plan(recipe, limits_of(bench)), bench, gyro, 4, {})
    store.recordings.add_import(to_points(recording), AT)
    fit_unit(store, unit.serial, unit.request, AT)
    store.calibrations.certify(unit.serial, 1, "certify", by="A", reason="meets the criteria", at=AT)


def figures_of(unit: Unit) -> list[Figure]:
    """Make a unit in a database of its own, which the service closes in the end, and read its figures."""
    with tempfile.TemporaryDirectory() as folder, open_store(str(Path(folder) / "lab.sqlite"), write=True) as store:
        _made(store, unit)
        return list(figures(store, unit))


def run() -> str:
    """Return the table of all figures, and how many agree."""
    lines, wrong, n = [], 0, 0
    for unit in UNITS:
        lines.append(f"\n{unit.serial}: " + "  ".join(NAMES))
        for figure in figures_of(unit):
            n += 1
            wrong += not figure.agrees
            shown = "  ".join(f"{name}={figure.said[name]}" for name in NAMES if name in figure.said)
            lines.append(f"{'  ' if figure.agrees else 'NO'} {figure.quantity:44} {shown}")
    return "\n".join([*lines, f"{n - wrong} of {n} quantities agree in every document"])
