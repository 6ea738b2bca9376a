"""Reference standards: three ways to state an uncertainty, and what cannot be one is refused."""

from __future__ import annotations

from datetime import date
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench_config import BenchFile, read_bench, shipped_benches
from instruments.standards import Standard


@pytest.mark.parametrize(
    ("given", "u"),
    [
        ({"u": 2.0}, 2.0),
        ({"expanded": 4.0}, 2.0),
        ({"expanded": 3.0, "k": 3.0}, 1.0),
        ({"half_width": 3.0, "distribution": "rectangular"}, 1.7320508),
        ({"half_width": 3.0, "distribution": "triangular"}, 1.2247449),
        ({"half_width": 3.0, "distribution": "u-shaped"}, 2.1213203),
    ],
)
def test_standard_uncertainty_by_how_it_is_stated(given: dict[str, Any], u: float) -> None:
    assert Standard(quantity="clock", **given).standard_u == pytest.approx(u)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "none of the keys u, expanded and half_width are given; give exactly one, in ppm"),
        ({"u": 1.0, "expanded": 2.0}, "u and expanded of the keys u, expanded and half_width are given"),
        ({"half_width": 1.0}, "half_width = 1 is not defined for a normal distribution; set distribution to one of"),
        ({"u": 1.0, "unit": "deg C"}, "unit 'deg C' is not accepted; give the uncertainty in ppm"),
        ({"u": 1.0, "calibrated": "2026-02-01", "due": "2026-01-01"}, "due 2026-01-01 is before calibrated 2026-02-01"),
        ({"u": -1.0}, "greater than or equal to 0"),
        ({"u": float("inf")}, "finite"),
        ({"u": 1.0, "certificat": "1"}, "Extra inputs"),
    ],
)
def test_what_cannot_be_a_standard_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Standard.model_validate({"quantity": "clock", **given})


def test_a_known_error_counts_until_the_bench_corrects_for_it() -> None:
    assert Standard(quantity="clock", u=1.0, value=-3.0).uncorrected == -3.0
    assert Standard(quantity="clock", u=1.0, value=-3.0, corrected=True).uncorrected == 0.0


def test_the_due_date_is_the_last_day() -> None:
    standard = Standard(quantity="clock", u=1.0, due=date(2026, 3, 1))
    assert not standard.is_overdue(date(2026, 3, 1))
    assert standard.is_overdue(date(2026, 3, 2))
    assert not Standard(quantity="clock", u=1.0).is_overdue(date(2099, 1, 1))


def test_one_quantity_under_one_name_is_stated_once() -> None:
    record = read_bench("single-axis-sim").model_dump(exclude_none=True)
    twice = {**record, "standards": [{"quantity": "clock", "u": 1.0}] * 2}
    with pytest.raises(ValidationError, match=r"two \[\[standards\]\] have the quantity 'clock' and the name ''"):
        BenchFile.model_validate(twice)


def test_every_simulated_bench_states_its_standards() -> None:
    names = {name for name in shipped_benches() if name.endswith("-sim")}
    # the papers state none, and poses are compared with gravity
    benches = {name: read_bench(name) for name in names - {"yang-paper-sim", "ojeda-paper-sim", "poses-sim"}}
    assert len(benches) == 5
    for name, bench in benches.items():
        stated = {each.quantity for each in bench.standards}
        expected = {"turn_angle"} if name == "by-hand-sim" else {"clock", "thermometer", "fixture_angle"}
        assert expected <= stated
        assert all(each.certificate and each.due for each in bench.standards)
