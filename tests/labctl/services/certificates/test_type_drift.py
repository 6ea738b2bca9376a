"""A unit without a history of its own drifts as a unit drawn from those of its model; the certificate says so."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from scipy.stats import t as student

from labctl.certificates.document import Certificate
from labctl.errors import BadCalibrationFile
from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY
from labctl.fitting.uncertainty.combination import half_width
from labctl.services.calibrations import type_drift
from labctl.services.calibrations.stability import NO_HISTORY, Stability, stability_of
from labctl.services.certificates.issue import issue
from labctl.store import Store, open_store
from tests.helpers.certificates import AT, SERIAL, add_version, request, simulated
from tests.helpers.drifting_units import BEGUN, MODEL, add_drifting_unit

#: Drifts of other units, deg/s per year.
DRIFTS = {"A-1": 0.010, "A-2": 0.030, "A-3": 0.014, "A-4": -0.002}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def add_type(store: Store, drifts: dict[str, float] = DRIFTS, **changed: Any) -> None:
    for years, (serial, drift) in enumerate(drifts.items(), start=1):
        add_drifting_unit(store, serial, {0.0: 0.0, 0.8 * years: drift * 0.8 * years}, **changed)


def typical(store: Store, serial: str = "N-1", version: int = 1) -> Stability:
    found = stability_of(store, serial, version)
    assert isinstance(found, Stability), found
    return found


def test_a_unit_without_a_history_takes_the_drift_of_its_type(store: Store) -> None:
    add_type(store)
    add_drifting_unit(store, "N-1", {1.0: 0.0})
    found, drifts = typical(store), np.array(list(DRIFTS.values()))
    u, freedom = found.worst
    assert u == pytest.approx(drifts.std(ddof=1) * np.sqrt(1 + 1 / 4), rel=1e-6)
    assert freedom == pytest.approx(3)
    assert found.mean_dps(2.0) == pytest.approx(2 * drifts.mean(), rel=1e-6)
    spread = 2 * student(3).ppf(0.5 * (1 + COVERAGE_PROBABILITY)) * u
    assert found.expanded_dps(2.0) == pytest.approx(half_width(spread, 2 * drifts.mean()), rel=1e-6)
    assert found.of_type is not None
    assert (found.of_type.model, found.of_type.units) == (MODEL, 4)
    assert found.of_type.over_years == pytest.approx((0.8, 3.2))


def test_drifts_of_either_sign_have_a_mean_near_zero_and_a_spread(store: Store) -> None:
    add_type(store, {"A-1": 0.02, "A-2": -0.02, "A-3": 0.0})
    add_drifting_unit(store, "N-1", {1.0: 0.0})
    found = typical(store)
    assert found.mean_dps(1.0) == pytest.approx(0.0, abs=1e-12)
    assert found.expanded_dps(1.0) == pytest.approx(4.527 * 0.02 * np.sqrt(4 / 3), rel=1e-3)


@pytest.mark.parametrize(
    ("changed", "units"),
    [
        ({"model": "KVH another"}, "no other units have"),
        ({"warm_c": (30.0, 40.0)}, "no other units have"),
        ({"real": True}, "no other units have"),
        ({"drifts": {"A-1": 0.01}}, "1 other unit has"),
        ({"drifts": {"A-1": 0.01, "A-2": 0.02}}, "2 other units have"),
    ],
)
def test_too_few_comparable_units_leave_the_drift_unknown(store: Store, changed: dict[str, Any], units: str) -> None:
    add_type(store, **changed)
    add_drifting_unit(store, "N-1", {1.0: 0.0})
    found = stability_of(store, "N-1", 1)
    assert isinstance(found, str)
    assert found.startswith(NO_HISTORY)
    assert units in found
    assert "the drift of a type takes 3" in found


def test_calibrations_of_one_season_say_nothing_of_the_years(store: Store) -> None:
    for serial in DRIFTS:
        add_drifting_unit(store, serial, {0.0: 0.0, 0.2: 0.01})
    add_drifting_unit(store, "N-1", {1.0: 0.0})
    assert "no other units have" in str(stability_of(store, "N-1", 1))


def test_a_unit_without_a_model_has_no_type(store: Store) -> None:
    add_type(store, model="")
    add_drifting_unit(store, "N-1", {1.0: 0.0}, model="")
    assert "model of the item is not stated" in str(stability_of(store, "N-1", 1))


def test_real_units_are_a_type_of_real_ones(store: Store) -> None:
    add_type(store, real=True)
    add_type(store, {f"S-{n}": 1.0 for n in range(4)})
    add_drifting_unit(store, "N-1", {1.0: 0.0}, real=True)
    assert typical(store).mean_dps(1.0) == pytest.approx(np.mean(list(DRIFTS.values())))


def test_a_history_of_its_own_goes_first_once_it_has_two_intervals(store: Store) -> None:
    add_type(store)
    add_drifting_unit(store, "N-1", {0.0: 0.0, 1.0: 0.012})
    one = typical(store, version=2)
    assert one.of_type is not None
    assert one.intervals == 1
    add_drifting_unit(store, "N-1", {2.0: 0.024})
    two = typical(store, version=3)
    assert two.of_type is None
    assert two.worst == pytest.approx((0.012, 2))


def test_a_single_interval_goes_first_where_the_unit_changed_more_than_its_type(store: Store) -> None:
    add_type(store)
    add_drifting_unit(store, "N-1", {0.0: 0.0, 1.0: 0.5})
    found = typical(store, version=2)
    assert found.of_type is None
    assert found.worst == pytest.approx((0.5, 1))


@pytest.mark.slow
def test_the_certificate_says_which_units_the_drift_is_of(store: Store) -> None:
    add_type(store)
    due = BEGUN + timedelta(days=365.25 * 2)
    store.recordings.add_import(simulated(), AT)
    version = certified(store, due)
    answer = issue(store, SERIAL, version, request(state_due=True), AT)
    found = Certificate.model_validate_json(store.certificates.forms(answer.number).document)
    stated, conformity, said = found.stability, found.conformity, " ".join(found.statements)
    assert stated is not None
    assert stated.type is not None
    assert conformity is not None
    assert stated.drift_dps is not None
    assert stated.intervals == 0
    mean = stated.type.mean_per_year_dps * stated.years
    assert stated.drift_dps == pytest.approx(half_width(stated.type.expanded_about_mean_dps, mean))
    assert "The drift of this item is not known from calibrations of its own." in said
    assert f"the drift of 4 other units of model {MODEL} over 0.8 to 3.2 years" in said
    assert f"by {stated.type.mean_per_year_dps:.3g} °/s per year on average" in said
    largest = max(point.expanded_dps for point in found.results)
    whole = half_width(float(np.hypot(largest, stated.type.expanded_about_mean_dps)), mean)
    assert conformity.expanded_dps == pytest.approx(whole)
    assert f"the largest U of the results is {whole:.3g} °/s" in said
    assert (
        f"U contains a drift of {stated.drift_dps:.3g} °/s until {due.date()}, by 4 other units of model {MODEL}"
        in conformity.statement
    )


def certified(store: Store, due: datetime) -> int:
    version = add_version(store, certified=False)
    store.calibrations.certify(SERIAL, version, "certify", by="A", reason="meets the criteria", at=AT, due_at=due)
    return version


@pytest.mark.slow
def test_the_work_does_not_grow_with_the_fleet(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(type_drift, "MAX_UNITS", 5)
    add_type(store)
    add_drifting_unit(store, "N-1", {1.0: 0.0})
    few, _ = statements_of(store)
    add_type(store, {f"B-{n}": 0.01 for n in range(12)})
    many, found = statements_of(store)
    assert many == few < 16
    assert found.of_type is not None
    assert found.of_type.units == 5
    assert found.mean_dps(1.0) == pytest.approx(0.01)  # those that were certified last


def statements_of(store: Store) -> tuple[int, Stability]:
    seen: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        seen.append(statement)

    sa.event.listen(sa.Engine, "before_cursor_execute", note)
    try:
        found = typical(store)
    finally:
        sa.event.remove(sa.Engine, "before_cursor_execute", note)
    return len(seen), found


def test_a_damaged_calibration_of_another_unit_is_named(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    add_type(store)
    add_drifting_unit(store, "N-1", {1.0: 0.0})
    whole = store.certified_versions.documents

    def damaged(ids: list[int]) -> dict[int, bytes]:
        return {number: content.replace(b'"A-2"', b'"A-9"') for number, content in whole(ids).items()}

    monkeypatch.setattr(store.certified_versions, "documents", damaged)
    with pytest.raises(BadCalibrationFile, match=r"A-2 version 1, .*edited or damaged.*labctl check"):
        stability_of(store, "N-1", 1)
