"""Two calibrations of one unit compared: En, zeta, and what both share."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from instruments.standards import Standard
from labctl.answers.calibrations import FitRequest
from labctl.answers.validity import ComparedResult, LaboratoryComparison
from labctl.errors import BadInput, Conflict
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.interlaboratory import compare, pair_of
from labctl.store import Store, open_store
from tests.helpers.certificates import simulated
from tests.helpers.register import noon

SERIAL = "FOG-0001"
#: Most of what the unit does, so that its scale factor is nearly as uncertain as the clock.
EFFECTS = ["bias", "bias_temperature:3", "scale_factor", "scale_factor_temperature:2"]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def clock(u_ppm: float, certificate: str) -> Standard:
    return Standard(quantity="clock", name="counter", u=u_ppm, certificate=certificate)


def measure(store: Store, day: date, standard: Standard, scale: float = 0.0, serial: str = SERIAL) -> int:
    """Import a recording with a scale factor error added, fit it; returns the version."""
    recording = simulated()
    columns = {**recording.columns, "gyro_z": np.asarray(recording.columns["gyro_z"]) * (1 + scale)}
    update = {"serial": serial, "started_at": noon(day), "standards": (standard,)}
    info = recording.info.model_copy(update=update)
    number = store.recordings.add_import(replace(recording, info=info, columns=columns), noon(day))
    request = FitRequest(effects=EFFECTS, recording=number)
    return fit_unit(store, serial, request, noon(day)).version


def compared(store: Store, first: Standard, second: Standard, scale: float) -> LaboratoryComparison:
    versions = measure(store, date(2026, 1, 5), first), measure(store, date(2026, 6, 1), second, scale)
    return compare(store, (SERIAL, versions[0]), (SERIAL, versions[1]))


def scale_factor(found: LaboratoryComparison) -> ComparedResult:
    (one,) = [each for each in found.results if each.result == "scale_factor"]
    return one


@pytest.mark.slow
def test_scores_of_two_laboratories_with_standards_of_their_own(store: Store) -> None:
    found = compared(store, clock(6000.0, "A-1"), clock(9000.0, "B-1"), -0.03)
    one = scale_factor(found)
    assert found.shared == []
    assert one.shared_u == 0.0
    assert one.difference == pytest.approx(0.03 * (1 + one.values[0]), rel=1e-3)
    assert one.en == pytest.approx(one.difference / math.hypot(*one.expanded))
    assert one.en == one.en_if_independent
    u = [expanded / k for expanded, k in zip(one.expanded, one.k, strict=True)]
    assert one.zeta == pytest.approx(one.difference / math.hypot(*u))
    assert u[0] == pytest.approx(6e-3, rel=0.2)  # the clock leads in both, what the model leaves is less
    assert one.en_performance == "unsatisfactory"
    assert not found.satisfactory
    assert found.text[0].startswith("scale_factor of axis z: En = 1.")


@pytest.mark.slow
def test_laboratories_that_agree(store: Store) -> None:
    found = compared(store, clock(6000.0, "A-1"), clock(9000.0, "B-1"), -0.01)
    assert found.satisfactory
    assert found.text == ["All 2 results agree within their expanded uncertainties (|En| <= 1)."]


@pytest.mark.slow
def test_a_shared_standard_is_said_and_its_part_subtracted(store: Store) -> None:
    same = clock(9000.0, "A-1")
    found = compared(store, same, same, -1.4e-2)
    one = scale_factor(found)
    assert found.shared == [same.label]
    assert one.shared_u == pytest.approx(9e-3 * (1 + one.values[0]), rel=1e-2)
    assert abs(one.en_if_independent) < 1 < abs(one.en)  # the clock cannot explain what it adds to both
    assert any("correlated by it" in text for text in found.text)


@pytest.mark.slow
def test_equal_numbers_of_two_laboratories_are_no_shared_standard(store: Store) -> None:
    first, second = (clock(9000.0, "1").model_copy(update={"issued_by": name}) for name in ("PTB", "NPL"))
    assert compared(store, first, second, -4e-3).shared == []


@pytest.mark.slow
def test_what_cannot_be_compared_is_refused(store: Store) -> None:
    standard = clock(100.0, "A-1")
    version = measure(store, date(2026, 1, 5), standard)
    measure(store, date(2026, 1, 5), standard, serial="FOG-2")
    with pytest.raises(BadInput, match="compare results of one unit"):
        compare(store, (SERIAL, version), ("FOG-2", 1))
    again = fit_unit(store, SERIAL, FitRequest(effects=["bias"]), noon(date(2026, 1, 6))).version
    with pytest.raises(Conflict, match="are both fitted to recording 1: nothing was measured twice"):
        compare(store, (SERIAL, version), (SERIAL, again))
    other = measure(store, date(2026, 2, 5), standard)
    with pytest.raises(BadInput, match="400 deg C is outside"):
        compare(store, (SERIAL, version), (SERIAL, other), 400.0)


@pytest.mark.slow
def test_a_result_that_one_of_them_lacks_is_named(store: Store) -> None:
    version = measure(store, date(2026, 1, 5), clock(100.0, "A-1"))
    measure(store, date(2026, 2, 5), clock(100.0, "B-1"))
    bare = fit_unit(store, SERIAL, FitRequest(effects=["bias"]), noon(date(2026, 2, 6))).version
    found = compare(store, (SERIAL, version), (SERIAL, bare))
    assert [each.result for each in found.results] == ["bias"]
    assert found.not_compared == {"scale_factor of axis z": f"version {bare} does not have it"}


@pytest.mark.parametrize("given", ["FOG-0001", "FOG-0001:", ":1", "FOG-0001:one", "FOG-0001:-1"])
def test_what_is_no_version_is_refused(given: str) -> None:
    with pytest.raises(BadInput, match="write SERIAL:VERSION"):
        pair_of(given)


def test_a_serial_number_may_have_a_colon_free_name_with_dots() -> None:
    assert pair_of("FOG.1 #2:12") == ("FOG.1 #2", 12)
