"""The certificate of an imported recording by page, once its files state what no order can."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from labctl.services.recordings.transfer import import_folder
from tests.helpers.browser import Service
from tests.helpers.certificates import ORDER
from tests.helpers.certifying import OVERRIDE
from tests.helpers.paths import EXAMPLES

if TYPE_CHECKING:
    from playwright.sync_api import Page

UNIT = "OSU-FOG-2024"
#: What the files of the real gyro do not state, and a certificate needs.
STATED = """
[datasheet]
bias_repeatability_dps = 0.02

[[standards]]
quantity = "table_rate"
u = 50.0
certificate = "T-17"
issued_by = "national metrology institute"
calibrated = 2024-01-05
due = 2027-01-05
"""
#: Name of a field of the form -> what is filled in.
ENTRIES = {
    **{f"laboratory_{key}": ORDER["laboratory"][key] for key in ("name", "street", "post_code", "city", "email")},
    "laboratory_country": "de",
    **{key: ORDER["customer"][key] for key in ("name", "street", "post_code", "city", "country", "email")},
    "by": "I. Issuer",
    "manufacturer": "KVH",
    "condition": "No visible damage.",
    "method_name": "rate steps on a rate table",
    "performed_until": "2024-08-01",
}


@pytest.mark.slow
def test_an_imported_recording_gets_its_certificate_by_page(
    service: Service, visit: Callable[..., Page], tmp_path: Path
) -> None:
    from playwright.sync_api import expect

    folder = tmp_path / "osu-fog"
    shutil.copytree(EXAMPLES / "osu-fog", folder)
    with (folder / "recording.toml").open("a", encoding="utf-8") as head:
        head.write(STATED)
    import_folder(service.lab_service.store, folder, datetime(2027, 3, 1, tzinfo=UTC))
    service.post(f"/api/units/{UNIT}/calibrations", {"model": "ojeda2000"})
    service.post(f"/api/units/{UNIT}/calibrations/1/certify", {"by": "Ada Authoriser", **OVERRIDE})

    page = visit(f"/units/{UNIT}")
    page.get_by_role("button", name="Issue certificate").click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_label("Name of the method")).to_be_visible()
    assert dialog.get_by_label("First day of the measurements").count() == 0  # the recording states it
    for name, text in ENTRIES.items():
        dialog.locator(f"input[name={name}]").fill(text)
    dialog.get_by_role("button", name="Issue").click()
    expect(page.get_by_role("group", name="Certificate 20")).to_be_visible()
    document = service.get(f"/api/units/{UNIT}/calibrations/1/certificate?format=json")
    assert document["method"]["name"] == ENTRIES["method_name"]
    assert (document["performed_from"], document["performed_until"]) == ("2024-08-01", "2024-08-01")
    assert document["laboratory"]["country"] == "DE"
