"""A promise until a date holds what the unit drifts by until then, or says that this is not known."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from labctl.answers.calibrations import FitRequest
from labctl.certificates.document import Certificate
from labctl.errors import BadInput
from labctl.recording import Recording, to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.stability import (
    NO_HISTORY,
    NOT_COMPARABLE,
    Stability,
    stability_of,
    version_measured_at,
    years_until,
)
from labctl.services.certificates.issue import issue
from labctl.store import Store, open_store
from tests.helpers.certificates import AT, SERIAL, request, simulated
from tests.helpers.simulated_recordings import three_axes

EFFECTS = ["bias", "bias_temperature:3", "scale_factor", "scale_factor_temperature:2", "misalignment"]
BEGUN = datetime(2026, 2, 1, tzinfo=UTC)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def later(years: float, drift_dps: float, scale: float = 0.0) -> Recording:
    """Return the simulated recording some years later, its bias and its scale factor changed."""
    found = simulated()
    rate = np.asarray(found.columns["table_rate_dps"], dtype=np.float64)
    gyro = np.asarray(found.columns["gyro_z"], dtype=np.float64) + drift_dps + scale * rate
    info = found.info.model_copy(update={"started_at": BEGUN + timedelta(days=365.25 * years)})
    return Recording(info, {**found.columns, "gyro_z": gyro}, found.environment)


def add(store: Store, recording: Recording, due: datetime | None = None) -> int:
    store.recordings.add_import(recording, AT)
    version = fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), AT).version
    store.calibrations.certify(SERIAL, version, "certify", by="A", reason="meets the criteria", at=AT, due_at=due)
    return version


def certificate(store: Store, version: int, **order: object) -> Certificate:
    answer = issue(store, SERIAL, version, request(state_due=True, **order), AT)
    return Certificate.model_validate_json(store.certificates.forms(answer.number).document)


@pytest.mark.slow
def test_the_drift_is_that_of_the_unit_per_year(store: Store) -> None:
    assert str(stability_of(store, SERIAL, add(store, later(0.0, 0.0)))).startswith(NO_HISTORY)
    add(store, later(0.5, 0.010))
    version = add(store, later(2.5, 0.030))
    found = stability_of(store, SERIAL, version)
    assert isinstance(found, Stability)
    per_year_dps, intervals = found.worst
    assert intervals == 2
    assert per_year_dps == pytest.approx(np.sqrt((0.02**2 + 0.01**2) / 2), rel=1e-3)
    assert found.expanded_dps(2.0) == pytest.approx(student(2).ppf(0.97725) * per_year_dps * 2.0, rel=1e-3)
    row = store.calibrations.get(SERIAL, version)
    measured = version_measured_at(store, row)
    assert measured is not None
    assert years_until(measured, BEGUN + timedelta(days=365.25 * 4.0)) == pytest.approx(1.5)
    assert years_until(measured, BEGUN) == 0.0


@pytest.mark.slow
def test_it_is_that_of_the_worst_place(store: Store) -> None:
    add(store, later(0.0, 0.0))
    found = stability_of(store, SERIAL, add(store, later(1.0, 0.0, scale=1e-4)))
    assert isinstance(found, Stability)
    assert found.worst[0] == pytest.approx(1e-4 * 100.0, rel=0.02)  # of 100 deg/s


@pytest.mark.slow
def test_two_versions_of_one_day_are_no_interval(store: Store) -> None:
    add(store, later(0.0, 0.0))
    assert str(stability_of(store, SERIAL, add(store, later(0.01, 0.05)))).startswith(NO_HISTORY)


def test_a_due_date_that_nothing_states_is_an_error(store: Store) -> None:
    version = add(store, later(0.0, 0.0))
    with pytest.raises(BadInput, match=f"date of the next calibration.*labctl certify {SERIAL} {version} --due-days"):
        certificate(store, version)


def test_without_a_history_the_certificate_says_that_the_drift_is_not_known(store: Store) -> None:
    version = add(store, later(0.0, 0.0), due=datetime(2028, 3, 1, tzinfo=UTC))
    found = certificate(store, version)
    assert found.stability is not None
    assert (found.stability.drift_dps, found.stability.intervals) == (None, 0)
    assert found.conformity is not None
    for text in (" ".join(found.statements), found.conformity.statement):
        assert "until 2028-03-01 is not known" in text


@pytest.mark.slow
def test_with_a_history_the_promise_contains_the_drift(store: Store) -> None:
    add(store, later(0.0, 0.0))
    add(store, later(1.0, 0.01))
    due = BEGUN + timedelta(days=365.25 * 3)
    found = certificate(store, add(store, later(2.0, 0.02), due=due))
    stated, conformity = found.stability, found.conformity
    assert stated is not None
    assert conformity is not None
    assert stated.drift_dps is not None
    assert stated.drift_dps == pytest.approx(student(2).ppf(0.97725) * 0.01, rel=0.01)
    largest = max(point.expanded_dps for point in found.results)
    assert conformity.expanded_dps == pytest.approx(np.hypot(largest, stated.drift_dps), rel=1e-9)
    assert f"U contains a drift of {stated.drift_dps:.3g} °/s until {due.date()}" in conformity.statement
    assert f"the largest U of the results is {conformity.expanded_dps:.3g} °/s" in " ".join(found.statements)


@pytest.mark.slow
def test_versions_that_share_a_recording_are_no_interval(store: Store) -> None:
    add(store, later(0.0, 0.0))
    store.recordings.add_import(later(1.0, 0.02), AT)
    joint = FitRequest(effects=["bias", "scale_factor"], recordings=[1, 2])
    version = fit_unit(store, SERIAL, joint, AT).version
    store.calibrations.certify(SERIAL, version, "certify", by="A", reason="meets the criteria", at=AT)
    assert str(stability_of(store, SERIAL, version)).startswith(NO_HISTORY)


@pytest.mark.slow
def test_a_place_that_an_earlier_version_does_not_cover_is_not_known(store: Store) -> None:
    narrow = later(0.0, 0.0)
    cool = np.asarray(narrow.columns["temperature_c"]) < 35.0
    add(store, Recording(narrow.info, {name: values[cool] for name, values in narrow.columns.items()}, None))
    assert str(stability_of(store, SERIAL, add(store, later(1.0, 0.02)))).startswith(NOT_COMPARABLE)


@pytest.mark.slow
def test_about_any_axis_the_drift_of_a_misalignment_counts(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        for years, angle in ((0.0, 0.0), (1.0, 1e-3)):
            found = to_points(three_axes(1))
            info = found.info.model_copy(update={"started_at": BEGUN + timedelta(days=365.25 * years)})
            about_y = np.where(found.columns["position"] == "y", found.columns["table_rate_dps"], 0.0)
            columns = {**found.columns, "gyro_x": found.columns["gyro_x"] + angle * about_y}
            number = store.recordings.add_import(Recording(info, columns, found.environment), AT)
            made = fit_unit(store, found.info.serial, FitRequest(effects=EFFECTS, recording=number), AT).version
            store.calibrations.certify(found.info.serial, made, "certify", by="A", reason="meets the criteria", at=AT)
        own, any_axis = (stability_of(store, "STIM-0001", 2, about) for about in ("own axis", "any axis"))
    assert isinstance(own, Stability)
    assert isinstance(any_axis, Stability)
    assert own.worst[0] < 0.01
    assert any_axis.worst[0] == pytest.approx(1e-3 * 400.0, rel=0.02)
