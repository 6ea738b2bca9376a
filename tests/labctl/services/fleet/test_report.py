"""The report on a type: what no single unit shows is named by all together, and a batch that differs is found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest

from labctl.answers.fleet import FleetChartRequest, FleetReportRequest, FleetReportResponse, FleetUnits
from labctl.calibration import read_calibration
from labctl.errors import BadInput, NotFound
from labctl.services.fleet.evidence import content_of, sums_in
from labctl.services.fleet.figures import fleet_chart, type_figures
from labctl.services.fleet.report import fleet_report
from labctl.store import FleetFilter, Store, open_store
from tests.helpers.fleets import AT, run_job, unit_points

UNITS = 12
BATCHES = {"B1": (0, 3, 6, 9), "B2": (1, 2, 4, 7, 10), "B3": (5, 8, 11)}
#: Error of a cubic at the largest rate, deg/s: some two standard uncertainties of what one unit shows of it.
CUBIC_DPS = 0.0022
NOW = AT + timedelta(days=400)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """Return a store with a type whose units all have a small cubic, and one batch with another scale factor."""
    with open_store(str(tmp_path_factory.mktemp("fleet") / "lab.sqlite"), write=True) as opened:
        for number in range(UNITS):
            scale = 0.02 if number in BATCHES["B1"] else 0.0
            opened.recordings.add_import(unit_points(number, scale=scale, cubic=CUBIC_DPS), AT)
        opened.recordings.add_import(unit_points(100, "MEMS-B"), AT)
        for batch, numbers in BATCHES.items():
            opened.units.set_batch([f"U{number:05d}" for number in numbers], batch, None, "Ann", AT)
        assert run_job(opened, type="FOG-A", effects=["bias", "scale_factor"]).done == UNITS
        assert run_job(opened, kind="criticise", type="FOG-A").done == UNITS
        opened.calibrations.certify("U00000", 1, "certify", by="Ann", reason="good", at=AT, due_at=NOW)
        later = NOW + timedelta(days=20)
        opened.calibrations.certify("U00001", 1, "certify", by="Ann", reason="good", at=AT, due_at=later)
        yield opened


@pytest.fixture(scope="module")
def report(store: Store) -> FleetReportResponse:
    return fleet_report(store, FleetReportRequest(type="FOG-A"), NOW)


@pytest.mark.slow
def test_an_effect_that_hardly_a_unit_shows_is_named_for_the_type(store: Store, report: FleetReportResponse) -> None:
    (found,) = report.missing
    assert "scale_factor_odd" in found.effects
    assert found.rms_unit_z < 3.5
    assert found.common
    assert report.evidence_units == UNITS
    assert any(sentence == found.text for sentence in report.text)
    assert report.figures.verdicts.get("adequate", 0) >= UNITS - 2


@pytest.mark.slow
def test_the_batch_that_differs_is_found_and_said(report: FleetReportResponse) -> None:
    (group,) = [each for each in report.groups if each.factor == "batch"]
    assert group.level == "B1"
    assert group.coefficients == ["x.scale_factor"]
    assert abs(group.shift) == pytest.approx(0.02, rel=0.2)
    assert group.text in report.text
    assert report.compared == UNITS


@pytest.mark.slow
def test_figures_count_each_unit_once(store: Store, report: FleetReportResponse) -> None:
    figures = report.figures
    assert figures.units == figures.fitted == figures.criticised == UNITS
    assert sum(each.units for each in figures.error_over_floor) == UNITS
    due = figures.due
    assert (due.overdue, due.within_30_days, due.none_in_force) == (1, 1, UNITS - 2)
    types = {each.type: each.units for each in type_figures(store, FleetUnits(), NOW)}
    assert types == {"FOG-A": UNITS, "MEMS-B": 1}


@pytest.mark.slow
def test_a_chart_shows_each_unit_once_by_batch_over_time(store: Store) -> None:
    chart = fleet_chart(store, FleetChartRequest(type="FOG-A", axis="x", name="scale_factor"))
    assert {point.level: point.units for point in chart.points}.keys() == set(BATCHES)
    assert sum(point.units for point in chart.points) == UNITS
    of_b1 = [point.mean for point in chart.points if point.level == "B1"]
    of_b2 = [point.mean for point in chart.points if point.level == "B2"]
    assert abs(sum(of_b1) / len(of_b1) - sum(of_b2) / len(of_b2)) == pytest.approx(0.02, rel=0.2)
    assert all(point.low <= point.mean <= point.high for point in chart.points)
    assert [point.at for point in chart.points if point.level == "B1"] == [
        AT + timedelta(days=n) for n in BATCHES["B1"]
    ]
    with pytest.raises(BadInput, match="is not known"):
        fleet_chart(store, FleetChartRequest(axis="x", name="sausage"))
    with pytest.raises(BadInput, match="choose one of"):
        fleet_chart(store, FleetChartRequest(axis="x", name="scale_factor", factor="colour"))


@pytest.mark.slow
def test_a_report_is_on_one_type(store: Store) -> None:
    with pytest.raises(BadInput, match="'FOG-A', 'MEMS-B'"):
        fleet_report(store, FleetReportRequest(), NOW)
    with pytest.raises(BadInput, match=r"no unit of type 'FOG-Z' matches; .* are of 'FOG-A', 'MEMS-B'"):
        fleet_report(store, FleetReportRequest(type="FOG-Z"), NOW)
    with pytest.raises(NotFound, match=r"^no unit matches batch 'B9', text 'X'; `labctl units` lists the units$"):
        fleet_report(store, FleetReportRequest(batch="B9", search="X"), NOW)
    alone = fleet_report(store, FleetReportRequest(type="MEMS-B"), NOW)
    assert (alone.compared, alone.missing, alone.groups) == (0, [], [])
    assert "at least 5" in alone.text[0]


@pytest.mark.slow
def test_of_a_part_of_a_type_nothing_is_said_that_takes_all_of_it(store: Store) -> None:
    part = fleet_report(store, FleetReportRequest(type="FOG-A", batch="B2"), NOW)
    assert (part.compared, part.missing, part.evidence_units) == (len(BATCHES["B2"]), [], 0)
    assert any("all of its units" in sentence for sentence in part.text)


@pytest.mark.slow
def test_criticisms_that_were_made_again_do_not_count_twice(store: Store) -> None:
    assert run_job(store, kind="criticise", search="U00003", again=True).done == 1
    report = fleet_report(store, FleetReportRequest(type="FOG-A"), NOW)
    assert report.evidence_units == 1  # the others were added to the older one of this unit
    assert any(f"criticisms of {UNITS - 1} units do not count" in sentence for sentence in report.text)
    assert run_job(store, kind="criticise", type="FOG-A", again=True).done == UNITS
    assert fleet_report(store, FleetReportRequest(type="FOG-A"), NOW).evidence_units == UNITS


@pytest.mark.slow
def test_sums_are_the_same_after_they_were_kept(store: Store) -> None:
    contents, _ = store.fleet_reports.evidence("FOG-A", "")
    sums = sums_in(contents[0])
    again = sums_in(content_of(sums))
    assert again.units == sums.units
    for bench, axes in sums.benches.items():
        for axis, each in axes.items():
            other = again.benches[bench][axis]
            assert other.shapes == each.shapes
            assert (other.information == each.information).all()


def test_all_figures_of_a_report_are_of_the_error_model(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        for number, model in enumerate(("bias", "bias_scale", "bias_scale")):
            store.recordings.add_import(unit_points(number), AT)
            assert run_job(store, search=f"U{number:05d}", model=model, effects=[]).done == 1
        of_any = fleet_report(store, FleetReportRequest(), NOW)
        of_bias = fleet_report(store, FleetReportRequest(model="bias"), NOW)
        assert [(each.figures.units, each.figures.fitted) for each in (of_any, of_bias)] == [(3, 3), (1, 1)]
        for request in (FleetReportRequest(model="turns"), FleetReportRequest(type=of_any.type, model="turns")):
            with pytest.raises(NotFound, match=r"no unit matches .*error model 'turns'; `labctl units` lists"):
                fleet_report(store, request, NOW)


@pytest.mark.slow
def test_versions_come_newest_recording_first(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        for number in range(3):
            store.recordings.add_import(unit_points(number), AT)
        assert run_job(store).done == 3
        again = unit_points(1)
        later = again.info.model_copy(update={"started_at": AT + timedelta(days=300)})
        store.recordings.add_import(replace(again, info=later), AT)
        assert run_job(store).done == 1
        versions = list(store.fleet_reports.versions(FleetFilter("FOG-A"), 100))
        assert [each.serial for each in versions] == ["U00001", "U00002", "U00001", "U00000"]
        assert read_calibration(versions[0].document).document["version"] == 2
