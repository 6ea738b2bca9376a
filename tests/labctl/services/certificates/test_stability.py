"""A promise until a date holds what the unit drifts by until then, or says that this is not known."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from labctl.certificates.document import Certificate
from labctl.errors import BadInput
from labctl.recording import Recording
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.stability import stability_of, years_until
from labctl.services.certificates.issue import issue
from labctl.services.schemas.calibrations import FitRequest
from labctl.store import Store, open_store
from tests.helpers.certificates import AT, SERIAL, request, simulated

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


def test_the_drift_is_that_of_the_unit_per_year(store: Store) -> None:
    assert stability_of(store, SERIAL, add(store, later(0.0, 0.0))) is None
    add(store, later(0.5, 0.010))
    version = add(store, later(2.5, 0.030))
    found = stability_of(store, SERIAL, version)
    assert found is not None
    assert found.intervals == 2
    assert found.per_year_dps == pytest.approx(np.sqrt((0.02**2 + 0.01**2) / 2), rel=1e-3)
    assert found.expanded_dps(2.0) == pytest.approx(student(2).ppf(0.97725) * found.per_year_dps * 2.0, rel=1e-3)
    row = store.calibrations.get(SERIAL, version)
    assert years_until(store, row, BEGUN + timedelta(days=365.25 * 4.0)) == pytest.approx(1.5)
    assert years_until(store, row, BEGUN) == 0.0


def test_it_is_that_of_the_worst_place(store: Store) -> None:
    add(store, later(0.0, 0.0))
    found = stability_of(store, SERIAL, add(store, later(1.0, 0.0, scale=1e-4)))
    assert found is not None
    assert found.per_year_dps == pytest.approx(1e-4 * 100.0, rel=0.02)  # of 100 deg/s


def test_two_versions_of_one_day_are_no_interval(store: Store) -> None:
    add(store, later(0.0, 0.0))
    assert stability_of(store, SERIAL, add(store, later(0.01, 0.05))) is None


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
