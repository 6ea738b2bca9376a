"""One quantity has one figure in every document: certificate as JSON, DCC and pages, header, file, command, HTTP."""

from __future__ import annotations

import pytest

from studies.figures_agree import UNITS, Figure, Unit, figures_of, printed_in


@pytest.mark.slow
@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.serial)
def test_every_document_states_the_same(unit: Unit) -> None:
    found = figures_of(unit)
    assert len(found) > 5
    assert [each.quantity for each in found if not each.agrees] == []


@pytest.mark.parametrize(
    ("text", "unit", "beside", "value", "step"),
    [
        ("0.056 × 10⁻⁶", "deg/s", "", 0.056e-6, 1e-9),
        ("−20.32", "mrad", "0.21", -20.32e-3, 1e-5),
        ("24100", "ppm/K", "4000 *", 24100e-6, 100e-6),
        ("1.5e-3", "", "–", 1.5e-3, 1e-4),
    ],
)
def test_a_printed_number_is_read_in_its_unit(text: str, unit: str, beside: str, value: float, step: float) -> None:
    printed = printed_in(text, unit, beside)
    assert [printed.value, printed.step] == pytest.approx([value, step])
    assert Figure("a", {"json": value + 0.9 * step, "pages": printed}).agrees
    assert not Figure("a", {"json": value + 1.1 * step, "pages": printed}).agrees
