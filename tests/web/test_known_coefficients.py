"""The page of a unit of which some coefficients were not fitted but held at known values."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from tests.helpers.browser import Service

if TYPE_CHECKING:
    from playwright.sync_api import Page

UNIT = "OSU-FOG-2024"


@pytest.mark.slow
def test_the_page_names_what_was_held_and_its_source(service: Service, visit: Callable[..., Page]) -> None:
    from playwright.sync_api import expect

    service.post("/api/recordings/example", {"name": "osu-fog"})
    path = f"/api/units/{UNIT}/calibrations"
    (axis,) = service.post(path, {"model": "bias_scale"})["axes"]
    held = {
        "source": "data sheet <2026>", "reference_temperature_c": 42.0,
        axis: {"scale_factor": {"value": -0.0213, "u": 1e-4}},
    }  # fmt: skip
    answer = service.post(path, {"model": "bias_scale", "fixed": held})
    assert answer["axes"][axis]["coefficients"]["scale_factor"]["value"] == -0.0213

    page = visit(f"/units/{UNIT}?version=2")
    said = f"(source: data sheet <2026>): axis {axis}: scale_factor."
    expect(page.get_by_text(said)).to_have_text(
        f"Version 2 held these coefficients at known values and did not fit them {said}"
    )
    fitted = visit(f"/units/{UNIT}?version=1")
    expect(fitted.get_by_text("scale_factor_t1").first).to_be_visible()
    expect(fitted.get_by_text("at known values")).to_have_count(0)
