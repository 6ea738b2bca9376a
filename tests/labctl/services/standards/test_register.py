"""The register: what is entered, what is refused, and the state of a standard."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, timedelta
from pathlib import Path

import pytest
from pydantic import ValidationError

from labctl.answers.standards import StandardCertificateRequest, WithdrawFindingRequest
from labctl.errors import BadInput, Conflict, NotFound
from labctl.metrology.control_chart import MIN_HISTORY
from labctl.services.standards.register import add_certificate, count_by_state, one_standard, withdraw_finding
from labctl.services.standards.usage import affected
from labctl.store import Store, open_store
from tests.helpers import register
from tests.helpers.register import noon

DAY = date(2024, 1, 10)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def test_a_standard_is_found_by_its_label_and_by_its_serial_number(store: Store) -> None:
    register.add(store)
    assert one_standard(store, "SN-0815", DAY) == one_standard(store, "Pt100-7", DAY)
    assert one_standard(store, "Pt100-7", DAY).state == "no certificate"
    with pytest.raises(NotFound, match="labctl standards list"):
        one_standard(store, "Pt100-8", DAY)


def test_a_label_or_serial_number_names_one_standard(store: Store) -> None:
    register.add(store)
    for label, serial in (("Pt100-7", "SN-1"), ("Pt100-8", "SN-0815"), ("SN-0815", "")):
        with pytest.raises(Conflict, match="is already standard Pt100-7"):
            register.add(store, label, serial=serial)
    register.add(store, "Pt100-8", serial="")
    register.add(store, "Pt100-9", serial="")  # two without a serial number are two


def test_units_are_those_of_the_quantity(store: Store) -> None:
    with pytest.raises(BadInput, match="unit 'mK' is not accepted for thermometer; give deg C"):
        register.add(store, unit="mK")
    with pytest.raises(BadInput, match="no usual unit of 'angle' is known; give its unit"):
        register.add(store, "autocollimator", quantity="angle")
    assert register.add(store, "autocollimator", quantity="angle", unit="arcsec", serial="").unit == "arcsec"


def test_a_number_is_entered_twice_only_with_a_reason(store: Store) -> None:
    register.add(store)
    register.certificate(store, "T-1", DAY, 0.01)
    with pytest.raises(Conflict, match="certificate T-1 of standard Pt100-7 is in the register"):
        register.certificate(store, "T-1", DAY, 0.02)
    answer = register.certificate(store, "T-1", DAY, 0.02, reason="typed wrong")
    assert [each.points[0].value for each in answer.certificates] == [0.02]
    assert answer.predictions[0].value == 0.02


def test_a_correction_is_the_error_with_the_other_sign(store: Store) -> None:
    register.add(store)
    points = [
        {"nominal": 0.0, "correction": 0.03, "u": 0.01},
        {"nominal": 85.0, "value": 0.05, "expanded": 0.06, "k": 3},
    ]
    answer = register.certificate(store, "T-1", DAY, None, points=points)
    assert [(each.nominal, each.value, each.u) for each in answer.predictions] == [
        (0.0, -0.03, 0.01), (85.0, 0.05, pytest.approx(0.02)),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([{"value": 0.1}], "exactly one of u and expanded"),
        ([{"value": 0.1, "u": 0.1, "expanded": 0.2}], "exactly one of u and expanded"),
        ([{"value": 0.1, "correction": -0.1, "u": 0.1}], "value or correction, not both"),
        ([{"u": 0.1}, {"u": 0.2, "nominal": 3}], "give each point a nominal"),
        ([{"u": 0.1, "nominal": 3}, {"u": 0.2, "nominal": 3}], "two points have the nominal 3"),
        ([{"u": 0.0}], "greater than or equal to"),
        ([{"u": float("nan")}], "finite number"),
    ],
)
def test_points_that_mean_nothing_are_refused(points: list[dict[str, float]], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        StandardCertificateRequest.model_validate(
            {"number": "T", "laboratory": "L", "calibrated": DAY, "by": "M", "points": points}
        )


def test_days_to_come_are_refused(store: Store) -> None:
    register.add(store)
    asked = StandardCertificateRequest.model_validate(
        {"number": "T", "laboratory": "L", "calibrated": DAY, "by": "M", "points": [{"u": 0.1}]}
    )
    with pytest.raises(BadInput, match="is a day to come"):
        add_certificate(store, "Pt100-7", asked, noon(DAY - timedelta(days=1)))
    with pytest.raises(BadInput, match="is a time to come"):
        register.check(store, DAY, 0.1, checked_at=noon(DAY + timedelta(days=1)))


def test_a_history_of_checks_judges_what_stated_uncertainties_let_pass(store: Store) -> None:
    register.add(store)
    register.certificate(store, "T-1", DAY, 0.0, expanded=0.4)  # 3 u are 0.6
    for n in range(MIN_HISTORY):
        assert register.check(store, DAY + timedelta(days=n + 1), 0.01 * (-1) ** n).state == "valid"
    answer = register.check(store, DAY + timedelta(days=40), 0.2)
    assert answer.state == "check it"
    (by_history,) = [each for each in answer.checks[-1].limits if each.basis == "history"]
    assert by_history.high == pytest.approx(3 * 0.02 / 1.128)
    assert by_history.values == MIN_HISTORY
    assert "by its history" in answer.text[0]
    assert count_by_state(store, DAY)["check it"] == 1
    again = register.check(store, DAY + timedelta(days=41), 0.01)  # repeated, and in limits
    assert (again.state, again.checks[-2].state) == ("valid", "out")


def test_checks_at_other_nominals_have_charts_of_their_own(store: Store) -> None:
    register.add(store)
    points = [{"nominal": 0.0, "value": 0.0, "u": 0.01}, {"nominal": 85.0, "value": 0.5, "u": 0.01}]
    register.certificate(store, "T-1", DAY, None, points=points)
    assert register.check(store, DAY, 0.5, nominal=85.0).checks[0].state == "in"
    answer = register.check(store, DAY, 0.5, nominal=0.0)
    assert {each.nominal: each.state for each in answer.checks} == {85.0: "in", 0.0: "out"}
    assert answer.state == "check it"


def test_only_a_finding_in_force_is_withdrawn(store: Store) -> None:
    register.add(store)
    asked = WithdrawFindingRequest(reason="r", by="Q")
    with pytest.raises(NotFound, match="has no finding 1 in force"):
        withdraw_finding(store, "Pt100-7", 1, asked, noon(DAY))
    register.bad(store, DAY, None, DAY)
    withdraw_finding(store, "Pt100-7", 1, asked, noon(DAY))
    with pytest.raises(NotFound, match="has no finding 1 in force"):
        withdraw_finding(store, "Pt100-7", 1, asked, noon(DAY))


def test_a_standard_that_nothing_was_measured_with_touches_nothing(store: Store) -> None:
    register.add(store)
    register.bad(store, DAY, None, DAY)
    found = affected(store, "Pt100-7")
    assert not found.calibrations
    assert found.text == ["No calibration was measured with standard Pt100-7 on these days."]
