"""A bench file against the register: what is reported, what is refused, and what a campaign records."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from datetime import date
from pathlib import Path
from typing import Any

import pytest

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from instruments.standards import Standard
from labctl.answers.calibrations import FitRequest
from labctl.calibration import read_calibration
from labctl.errors import Conflict
from labctl.services.benches.check import check_bench
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.uncertainty import coefficients_at
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.certificates.issue import issue
from labctl.services.certificates.served import certificate_file
from labctl.services.planning.loading import load_bench
from labctl.services.standards.agreement import as_used, differences, with_register
from labctl.services.standards.register import one_standard
from labctl.store import Store, open_store
from tests.helpers import register
from tests.helpers.certificates import SERIAL, request
from tests.helpers.register import COUNTER, thermometer

TODAY = date(2026, 1, 5)  #: of virtual clocks
ENTRY = thermometer("T-1", calibrated="2023-12-01", due="2026-06-30")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        register.add(opened)
        yield opened


def bench(*entries: Standard) -> BenchFile:
    return load_bench("single-axis-sim").model_copy(update={"standards": entries})


def said(store: Store, entry: Standard) -> str:
    return " | ".join(text for _, text in differences(store, [entry], TODAY))


def test_what_agrees_is_recorded_as_it_is(store: Store) -> None:
    assert as_used(store, [ENTRY], TODAY) == (ENTRY,)  # no certificate in the register
    register.certificate(store, "T-1", date(2023, 12, 1), None, due="2026-06-30")
    assert as_used(store, [ENTRY], TODAY) == (ENTRY,)
    assert said(store, ENTRY) == ""
    other = thermometer("X", name="Pt100-8")
    assert as_used(store, [other], TODAY) == (other,)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"due": "2027-01-31"},
            "due 2027-01-31 in the bench file, 2026-06-30 in the register; the earlier date counts",
        ),
        ({"u": 0.01}, r"u = 0.01 deg C in the bench file, 0.02 deg C by certificate T-1"),
        ({"certificate": "T-0"}, "certificate T-0 of the bench file is not in the register, whose newest is T-1"),
    ],
)
def test_differences_from_the_register_are_reported(store: Store, changed: dict[str, Any], words: str) -> None:
    register.certificate(store, "T-1", date(2023, 12, 1), None, due="2026-06-30")
    assert words in said(store, Standard.model_validate({**ENTRY.model_dump(), **changed}))


def test_equal_numbers_of_two_laboratories_are_two_certificates(store: Store) -> None:
    register.certificate(store, "T-1", date(2023, 12, 1), 0.5, due="2026-06-30")
    unnamed = thermometer("T-1", name="probe of the chamber", calibrated="2023-12-01", due="2026-06-30")
    assert as_used(store, [unnamed], TODAY)[0].value == 0.5  # DKD in both
    assert as_used(store, [unnamed.model_copy(update={"issued_by": " d.k.d "})], TODAY)[0].value == 0.5
    assert as_used(store, [unnamed.model_copy(update={"issued_by": ""})], TODAY)[0].value == 0.5
    other = unnamed.model_copy(update={"issued_by": "NPL"})
    assert as_used(store, [other], TODAY) == (other,)
    expected = "certificate T-1 of NPL in the bench file is in the register as one of DKD, of standard Pt100-7"
    assert expected in said(store, other)
    assert expected in said(store, ENTRY.model_copy(update={"issued_by": "NPL"}))  # the standard by its name


def test_a_standard_may_have_certificates_of_one_number_by_two_laboratories(store: Store) -> None:
    register.certificate(store, "1", date(2023, 12, 1), 0.01)
    register.certificate(store, "1", date(2024, 12, 1), 0.02, laboratory="NPL")
    with pytest.raises(Conflict, match="certificate 1 of standard Pt100-7 is in the register; to correct it"):
        register.certificate(store, "1", date(2024, 12, 1), 0.03, laboratory="npl")
    register.certificate(store, "1", date(2024, 12, 1), 0.03, laboratory="NPL", reason="typed wrong")
    found = one_standard(store, "Pt100-7", TODAY).certificates
    assert [(each.laboratory, each.points[0].value) for each in found] == [("DKD", 0.01), ("NPL", 0.03)]
    register.certificate(store, "1", date(2024, 12, 1), 0.03, laboratory="PTB", reason="laboratory was wrong")
    found = one_standard(store, "Pt100-7", TODAY).certificates
    assert [each.laboratory for each in found] == ["DKD", "PTB"]


def test_the_less_favourable_statement_counts(store: Store) -> None:
    register.certificate(store, "T-1", date(2023, 12, 1), None, due="2026-06-30")
    (used,) = as_used(store, [thermometer("T-1", u=0.005, due="2027-01-31")], TODAY)
    assert (used.standard_u, used.due) == (0.02, date(2026, 6, 30))
    (used,) = as_used(store, [thermometer("T-1", u=0.07, due="2026-02-01")], TODAY)
    assert (used.standard_u, used.due) == (0.07, date(2026, 2, 1))


def test_the_drift_and_the_known_error_of_the_day_are_recorded(store: Store) -> None:
    register.certificate(store, "T-1", date(2024, 1, 5), 0.010, due="2026-06-30")
    register.certificate(store, "T-2", date(2025, 1, 5), 0.030, due="2026-06-30")
    entry = thermometer("T-2", value=0.030, due="2026-06-30")
    (used,) = as_used(store, [entry], TODAY)
    h = 365 / 366  # 2024 was a leap year
    assert used.value == pytest.approx(0.030 + 0.020 * h)
    assert used.standard_u == pytest.approx(0.02 * math.hypot(1 + h, h))
    assert "with the uncertainty of its drift" in said(store, entry)
    (corrected,) = as_used(store, [entry.model_copy(update={"corrected": True})], TODAY)
    assert corrected.uncorrected == pytest.approx(0.020 * h)  # what the correction by 0.030 leaves
    assert used.uncorrected == used.value


@pytest.mark.slow
def test_a_campaign_records_what_the_register_predicts(store: Store) -> None:
    register.certificate(store, "T-1", date(2024, 1, 5), 0.010, due="2026-06-30")
    register.certificate(store, "T-2", date(2025, 1, 5), 0.030, due="2026-06-30")
    made = prepare(store, "short", bench(thermometer("T-2", due="2026-06-30")), VirtualClock(), clip=False)
    answer = run(store, made)
    (row,) = store.recordings.of_unit("FOG-0001")
    recorded = {each.quantity: each for each in row.recording_info.standards}
    assert recorded["thermometer"].standard_u == pytest.approx(0.0447, abs=1e-3)
    assert recorded["thermometer"].value == pytest.approx(0.05, abs=1e-3)
    assert store.campaigns.get(answer.id).bench["standards"][0]["u"] == 0.02  # what the bench file said is kept
    events = [each for each in store.campaigns.events(answer.id) if each.kind == "standard_differs"]
    assert any("with the uncertainty of its drift" in each.message for each in events)
    assert {each.level for each in events} == {"warning"}


@pytest.mark.slow
def test_budget_file_and_certificate_state_the_same_uncertainty(store: Store) -> None:
    register.certificate(store, "T-1", date(2024, 1, 5), 0.010, due="2026-06-30")
    register.certificate(store, "T-2", date(2025, 1, 5), 0.030, due="2026-06-30")
    entries = (COUNTER, thermometer("T-2", due="2026-06-30"))
    run(store, prepare(store, "short", bench(*entries), VirtualClock(), clip=False))
    fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), register.noon(TODAY))
    store.calibrations.certify(SERIAL, 1, "certify", by="Ada", reason="meets them", at=register.noon(TODAY))
    (predicted,) = one_standard(store, "Pt100-7", TODAY).predictions
    calibration = read_calibration(store.calibrations.get(SERIAL, 1).document)
    in_file = {each["quantity"]: each for each in calibration.document["standards"]["stated"]}
    assert (in_file["thermometer"]["u"], in_file["thermometer"]["value"]) == (predicted.u, predicted.value)
    (line,) = [each for each in coefficients_at(calibration, 25.0)["z"]["bias"].lines if each.source == "thermometer"]
    assert line.u == predicted.u
    issue(store, SERIAL, 1, request(conformity=None), register.noon(TODAY))
    document = json.loads(certificate_file(store, SERIAL, 1, "json").content)
    assert [each["u"] for each in document["standards"] if each["name"] == "Pt100-7"] == [predicted.u]


def test_a_campaign_with_a_bad_standard_is_refused_before_anything_is_written(store: Store) -> None:
    register.bad(store, date(2025, 12, 1), None, date(2025, 12, 24))
    with pytest.raises(Conflict, match=r"Pt100-7 was found bad from 2025-12-01 until now .*Put another standard"):
        prepare(store, "short", bench(ENTRY), VirtualClock(), clip=False)
    assert not store.campaigns.all()
    prepare(store, "short", bench(thermometer("T", name="Pt100-8")), VirtualClock(), clip=False).bench.close()


def test_the_check_of_a_bench_names_the_register(store: Store) -> None:
    answer = check_bench("single-axis-sim").model_copy(update={"checked_at": register.noon(TODAY)})
    assert with_register(store, answer, bench(thermometer("T", name="Pt100-8"))) == answer  # nothing of it is there
    register.certificate(store, "T-1", date(2023, 12, 1), None, due="2026-06-30")
    good, doubtful = (with_register(store, answer, bench(each)) for each in (ENTRY, thermometer("T-1")))
    assert (good.ok, good.devices[-1].state) == (True, "good")
    assert (doubtful.ok, doubtful.devices[-1].state) == (True, "doubtful")
    register.bad(store, date(2025, 12, 1), None, date(2025, 12, 24))
    failed = with_register(store, answer, bench(ENTRY))
    assert (failed.ok, failed.devices[-1].ok, failed.devices[-1].state) == (False, False, "bad")
    assert "found bad" in failed.devices[-1].text
