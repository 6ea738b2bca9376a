"""A law on the page Explore: it is tried as a change of the model, and the error falls as it says."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service, settled
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.unnamed_error import with_wave

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.fixture(scope="module")
def template(furnish: Callable[..., Path]) -> Path:
    """Take in a gyro whose residual no effect of the catalogue explains, and fit it."""

    def fitted(service: Service) -> None:
        recording = with_wave(single_axis(3))
        service.lab_service.store.recordings.add_import(recording, datetime(2026, 1, 5, tzinfo=UTC))
        service.post(f"/api/units/{recording.info.serial}/calibrations", {"model": "ojeda2000"})

    return furnish(fitted)


def shown(value_dps: float) -> str:
    """Return a value with the digits that the page shows."""
    return f"{value_dps:.3g}"


@pytest.mark.slow
def test_a_law_is_tried_and_the_error_falls_as_it_says(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    serial = service.get("/api/recordings/1")["serial"]
    page = visit(f"/explore?unit={serial}")
    settled(page)
    answer = service.get(f"/api/units/{serial}/calibrations/1/criticism")
    law = answer["laws"][0]
    card = page.get_by_role("region", name="Laws that describe it")
    expect(card.locator("code").first).to_have_text(law["equations"]["z"])
    expect(card).to_contain_text(law["follows"][0])
    card.get_by_role("button", name="Try this law").first.click()
    adding = page.get_by_role("region", name="Add it")
    expect(adding.get_by_label("A formula of your own")).to_have_value("\n".join(law["formulas"]))
    row = adding.get_by_role("row").filter(has_text="RMS residual")
    expect(row).to_contain_text(shown(law["rms_after_dps"]))
