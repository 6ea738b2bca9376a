"""Certainly wrong data on the pages: the refusal in its sentences, and the way to fit them nevertheless."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Faults, Service, settled
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.spoilt import at_one_dataset, spoilt, wrong_rate

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOG = "FOG-0001"


@pytest.mark.slow
def test_wrong_data_are_refused_in_words_and_fitted_only_when_it_is_insisted_on(
    service: Service, visit: Callable[..., Page], faults: Faults
) -> None:
    from playwright.sync_api import expect

    recording = spoilt(single_axis(1), at_one_dataset(80.0, wrong_rate))
    service.lab_service.store.recordings.add_import(recording, recording.info.started_at)
    path = f"/api/units/{FOG}/calibrations"
    page = visit(f"/explore?unit={FOG}")
    dialog = page.get_by_role("dialog", name="The fit is refused")

    page.get_by_label("Model", exact=True).select_option("ojeda2000")
    page.get_by_role("button", name="Fit", exact=True).click()
    expect(dialog).to_contain_text("Objections")
    expect(dialog).to_contain_text(
        "Wrong: data set 65, axis z: the rate is given as 60 deg/s, but the output shows 79.8"
    )
    expect(dialog).not_to_contain_text("--accept-warnings")
    dialog.get_by_role("button", name="Cancel").click()
    expect(dialog).to_have_count(0)
    assert service.get(path) == []
    expect(page.get_by_role("button", name="Fit", exact=True)).to_be_enabled()

    page.get_by_role("button", name="Fit", exact=True).click()
    dialog.get_by_role("button", name="Fit anyway").click()
    page.wait_for_url("**version=1**")
    expect(page.get_by_role("region", name="Verdict")).to_contain_text("The data are wrong: data set 65")
    assert [row["version"] for row in service.get(path)] == [1]

    adding = page.get_by_role("region", name="Add it")
    adding.get_by_label("Add an effect").select_option("scale_factor_asymmetry")
    adding.get_by_role("button", name="Preview").click()
    expect(adding).to_contain_text("Wrong: data set 65")
    adding.get_by_role("button", name="Make version 2").click()
    expect(dialog).to_contain_text("Wrong: data set 65")
    assert len(service.get(path)) == 1
    dialog.get_by_role("button", name="Make version anyway").click()
    page.wait_for_url("**version=2**")
    assert [row["version"] for row in service.get(path)] == [2, 1]
    expect(page.get_by_role("region", name="Verdict")).to_contain_text("version 2 compared with recording 1")
    settled(page)
    faults.clear()  # the browser itself logs each refusal
