"""A certificate of a unit whose campaign had a verification part: the statement rests on what no fit has seen."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.calibration import read_calibration
from labctl.certificates.document import Certificate
from labctl.compensator import Compensator
from labctl.fitting.data.fit_data import fit_data_of
from labctl.recording import Recording
from labctl.recording.verification import verification_part
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.uncertainty import budgets_at
from labctl.services.certificates.evidence import NotVerified
from labctl.services.certificates.issue import issue
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import Store, copy_database, open_store
from procedures.planning.plan import make_plan
from procedures.recipe.rules import Verification
from tests.helpers.certificates import AT, request

#: The same question of the same recording is answered once for the whole run.
pytestmark = pytest.mark.usefixtures("shared_answers")

SERIAL = "STIM-0001"


@pytest.fixture(scope="module")
def recording() -> Recording:
    recipe = load_recipe("table1-x-table2").model_copy(update={"verification": Verification(rates=6)})
    bench = load_bench("triaxial-sim")
    plan = make_plan(recipe, limits_of(bench))
    return hidden_recording(plan, bench, bench.gyros[0].model_copy(update={"sample_rate_hz": 1.0}), 4, {})


def certify(path: Path, recording: Recording) -> Path:
    """Make a database with a recording and a certified version that is fitted to it; returns its path."""
    with open_store(str(path), write=True) as store:
        store.recordings.add_import(recording, AT)
        version = fit_unit(store, SERIAL, FitRequest(model="yang2018"), AT).version
        store.calibrations.certify(SERIAL, version, "certify", by="Ada", reason="meets the criteria", at=AT)
    return path


@pytest.fixture(scope="module")
def certified(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return certify(tmp_path_factory.mktemp("certified") / "lab.sqlite", recording)


@pytest.fixture
def store(certified: Path, tmp_path: Path) -> Iterator[Store]:
    copy_database(str(certified), tmp_path / "lab.sqlite")
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def issued(store: Store, **conformity: Any) -> Certificate:
    """Return the certificate of the certified version."""
    ordered = {"specification": "S", "limit_dps": 2.0, "rule": "guard-band", **conformity}
    issue(store, SERIAL, 1, request(conformity=ordered), AT)
    row = store.certificates.newest(SERIAL, 1)
    assert row is not None
    return Certificate.model_validate_json(store.certificates.forms(row.number).document)


def test_it_states_each_error_that_was_verified(recording: Recording, store: Store) -> None:
    certificate = issued(store)
    calibration = read_calibration(store.calibrations.document(SERIAL, 1)[0])
    found = certificate.conformity
    assert found is not None
    assert (found.passed, found.evidence, found.datasets, len(found.results)) == (True, "verification", 18, 54)
    aside = verification_part(recording)
    assert aside is not None
    data = fit_data_of(aside)
    for each in found.results[::7]:
        rows = [
            i for i in range(len(data))
            if np.allclose([data.true_rate_dps(a)[i] for a in "xyz"], each.rates_dps, atol=1e-9)
        ]  # fmt: skip
        (row,) = rows
        outputs = np.array([data.outputs[axis][row] for axis in "xyz"])
        warm = np.array([[data.channels.temperature_c(axis)[row] for axis in "xyz"]])
        corrected = Compensator(calibration).compensate(outputs[None, :], warm).rate_dps[0]
        axis = "xyz".index(each.output)
        assert each.error_dps == pytest.approx(corrected[axis] - each.rates_dps[axis], abs=1e-9)
        budget = budgets_at(calibration, dict(zip("xyz", each.rates_dps, strict=True)), float(warm[0, axis]))[
            each.output
        ]
        across = 0.0 if data.channels.up(each.output)[row] else abs(float(data.channels.table_rate_dps()[row]))
        placed = math.radians(0.002) * across  # the mounting that verifies is one more
        assert budget.combined is not None
        assert budget.k is not None
        assert each.expanded_dps == pytest.approx(budget.k * math.hypot(budget.combined, placed), rel=2e-3)
    largest = max(abs(each.error_dps) for each in found.results)
    assert found.largest_error_dps >= largest  # the fitted data sets are in the range too
    assert f"not fitted to ({largest:.3g} °/s)" in found.statement
    assert all(each.expanded_dps <= found.expanded_dps for each in found.results)


@pytest.mark.slow
def test_an_error_that_only_the_verification_shows_fails(recording: Recording, tmp_path: Path) -> None:
    marked = np.asarray(recording.columns["verification"]) != 0
    columns = {n: v + 3.0 * marked if n == "gyro_y" else v for n, v in recording.columns.items()}
    with open_store(str(certify(tmp_path / "lab.sqlite", replace(recording, columns=columns))), write=True) as store:
        found = issued(store).conformity
    assert found is not None
    assert not found.passed
    assert {each.output for each in found.results if not each.passed} == {"y"}
    assert min(each.risk for each in found.results if each.output == "y") > 0.99


@pytest.mark.slow
def test_about_its_own_axis_an_output_is_judged_where_it_turned_about_it(store: Store) -> None:
    found = issued(store, about="own axis").conformity
    assert found is not None
    assert found.evidence == "verification"
    for each in found.results:
        others = [rate for axis, rate in zip("xyz", each.rates_dps, strict=True) if axis != each.output]
        assert np.abs(others).max() < 0.01  # the Earth's rate


@pytest.mark.slow
def test_a_verification_that_does_not_cover_the_use_decides_nothing(tmp_path: Path) -> None:
    part = Verification(rates=4, positions=("z",))
    recipe = load_recipe("table1-x-table2").model_copy(update={"verification": part})
    bench = load_bench("triaxial-sim")
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": 1.0})
    recording = hidden_recording(make_plan(recipe, limits_of(bench)), bench, gyro, 4, {})
    lacks = r"output x was verified about x .* needs rates in the outer thirds"
    with open_store(str(certify(tmp_path / "lab.sqlite", recording)), write=True) as store:
        for about in ("own axis", "any axis"):
            with pytest.raises(NotVerified, match=lacks):
                issued(store, about=about)
