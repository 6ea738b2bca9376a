"""The certificate on the page of a unit: its dialog is filled in, what is missing is named, the files are issued."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from instruments.bench_config import shipped_benches
from tests.helpers.browser import Faults, Service
from tests.helpers.certificates import ORDER
from tests.helpers.certifying import OVERRIDE
from tests.helpers.drafted_recipe import DRAFTED

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

UNIT = "FOG-0001"
LABORATORY = ORDER["laboratory"]
#: Data sets so near to each other, in rate and temperature, that the uncertainty of the model is known.
DENSE = DRAFTED.replace("[-20, -10, 0, 10, 20]", "[-60, -30, -20, -10, -5, 0, 5, 10, 20, 30, 60]").replace(
    "hold_s = 120", "hold_s = 7200"
)
ANSWERS = {
    "Issued by": "I. Issuer",
    "Customer": "Vehicle Works",
    "Street and number": "Track 1",
    "Post code": "ME1 1AA",
    "City": "Rochester",
    "Country": "GB",
    "E-mail": "r.driver@example.org",
    "Manufacturer of the item": "KVH",
    "Condition of the item on receipt": "No visible damage.",
    "Conformity to the specification": "VW-77, 3.2",
    "Limit of the error in the specification, deg/s": "3",
}

#: Label -> what it states of the laboratory, where the bench file does not.
LABORATORY_FIELDS = {
    "Laboratory": "name",
    "Street and number of the laboratory": "street",
    "Post code of the laboratory": "post_code",
    "City of the laboratory": "city",
    "Country of the laboratory": "country",
    "E-mail of the laboratory": "email",
}


@pytest.fixture
def laboratory() -> str:
    """Return the laboratory of the bench file."""
    return "\n".join(["", "[laboratory]", *(f"{name} = {json.dumps(value)}" for name, value in LABORATORY.items())])


@pytest.fixture
def recipe() -> str:
    return DENSE


@pytest.fixture
def service(tmp_path: Path, laboratory: str, recipe: str) -> Iterator[Service]:
    """Serve a bench of a laboratory, with a certified version that a campaign ended in."""
    bench = tmp_path / "bench.toml"
    bench.write_text(shipped_benches()["single-axis-sim"].read_text(encoding="utf-8") + laboratory)
    serving = Service(tmp_path, bench=str(bench))
    serving.start()
    serving.post("/api/campaigns", {"recipe": recipe})
    serving.until("/api/campaigns/1", lambda found: found["state"] == "done")
    serving.post("/api/campaigns/1/drafts", {})
    serving.post(f"/api/units/{UNIT}/calibrations/1/certify", {"by": "Ada Authoriser", **OVERRIDE})
    yield serving
    serving.stop()


def filled(page: Page, **changed: str) -> Locator:
    """Open the dialog, fill it in, and ask for the certificate; returns the dialog."""
    from playwright.sync_api import expect

    page.get_by_role("button", name="Issue certificate").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_role("button", name="Issue")).to_be_in_viewport(ratio=1)  # before anything is scrolled
    expect(dialog.get_by_label("Number of the order")).to_have_accessible_description("Optional.")
    for label, value in {**ANSWERS, **changed}.items():
        dialog.get_by_label(label, exact=True).fill(value)
    dialog.get_by_role("button", name="Issue").click()
    return dialog


@pytest.mark.slow
def test_the_dialog_asks_for_every_fact_names_what_is_missing_and_gives_the_certificate(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    page = visit(f"/units/{UNIT}")
    dialog = filled(page, City="")
    assert dialog.get_by_label("Laboratory", exact=True).count() == 0  # the bench file states it
    expect(dialog).to_be_visible()  # the browser asks for the city first
    dialog.get_by_label("City").fill("Rochester")
    dialog.get_by_label("With a guard band").check()
    dialog.get_by_label("The item turns about the axis of one output at a time").check()
    wrong = {"Condition of the item": " ", "Country": "Germany", "Limit of the error": "0,1"}
    for label, text in wrong.items():
        dialog.get_by_label(label).first.fill(text)
    dialog.get_by_role("button", name="Issue").click()
    for words in ("a blank entry is not enough", "Write the two letters of the country", "a number with a point"):
        expect(dialog.locator(".field-problem").filter(has_text=words)).to_be_visible()
    dialog.get_by_role("button", name="Cancel").click()
    page.get_by_role("button", name="Issue certificate").click()
    expect(dialog.get_by_label("Customer", exact=True)).to_have_value("Vehicle Works")  # nothing is typed twice
    expect(dialog.get_by_label("With a guard band")).to_be_checked()
    for label, text in {
        "Condition of the item": "No visible damage.",
        "Country": "gb",
        "Limit of the error": "3",
    }.items():
        dialog.get_by_label(label).first.fill(text)
    dialog.get_by_label("Received on").fill("1900-01-01")
    dialog.get_by_role("button", name="Issue").click()
    expect(dialog.locator(".field-problem")).to_contain_text("is more than 10 years before the calibration")
    assert service.get(f"/api/units/{UNIT}/certificates") == []  # nothing was written
    faults.clear()  # the browser complains of the answer 409
    expect(dialog.get_by_label("Customer", exact=True)).to_have_value("Vehicle Works")

    dialog.get_by_label("Received on").fill("")
    dialog.get_by_role("button", name="Issue").click()
    files = page.get_by_role("group", name="Certificate ICL-")
    expect(files).to_be_visible()
    (issued,) = service.get(f"/api/units/{UNIT}/certificates")
    expect(files).to_contain_text(issued["number"])
    with page.expect_download() as download:
        files.get_by_role("button", name="JSON").click()
    document = json.loads(download.value.path().read_text(encoding="utf-8"))
    assert document["laboratory"]["name"] == LABORATORY["name"]
    assert (document["customer"]["name"], document["item"]["condition"]) == ("Vehicle Works", "No visible damage.")
    assert document["customer"]["country"] == "GB"
    assert document["conformity"]["rule"] == "guard-band"
    assert document["conformity"]["about"] == "own axis"
    with page.expect_download() as download:
        files.get_by_role("button", name="PDF/A-3").click()
    assert download.value.path().read_bytes().startswith(b"%PDF")


@pytest.mark.slow
@pytest.mark.parametrize("laboratory", [""])
def test_a_laboratory_that_the_bench_file_does_not_name_is_asked_for(
    service: Service, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    missing = service.get(f"/api/units/{UNIT}/calibrations/1/certificate/missing")
    assert {each["table"] for each in missing} == {"laboratory", "customer", "item"}
    page = visit(f"/units/{UNIT}")
    page.get_by_role("button", name="Issue certificate").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("The measurement states no laboratory, so this form asks for it.")
    for label, name in LABORATORY_FIELDS.items():
        dialog.get_by_label(label, exact=True).fill(LABORATORY[name])
    for label, value in ANSWERS.items():
        dialog.get_by_label(label, exact=True).fill(value)
    dialog.get_by_label("The item turns about the axis of one output at a time").check()
    dialog.get_by_role("button", name="Issue").click()  # nothing was refused before
    files = page.get_by_role("group", name="Certificate 20")
    expect(files).to_be_visible()
    with page.expect_download() as download:
        files.get_by_role("button", name="JSON").click()
    stated = json.loads(download.value.path().read_text(encoding="utf-8"))["laboratory"]
    assert {name: stated[name] for name in LABORATORY_FIELDS.values()} == {
        name: LABORATORY[name] for name in LABORATORY_FIELDS.values()
    }
