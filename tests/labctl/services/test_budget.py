"""One U: document, HTTP, command line, figure and C header of a version state the same budget."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from typer.testing import CliRunner

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from labctl.calibration import read_calibration
from labctl.cli.app import app
from labctl.exports import export_calibration
from labctl.exports.uncertainty_bound import bounds_dps
from labctl.plots.contributions import contributions
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.store import open_store
from tests.helpers.service import add_recording, open_client
from tests.helpers.simulated_recordings import single_axis

UNIT = "/api/units/FOG-0001/calibrations"
STANDARDS = ["clock", "thermometer", "chamber_gradient", "fixture_angle", "tilt", "level"]


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("budget") / "lab.sqlite"


@pytest.fixture(scope="module")
def client(database: Path) -> Iterator[TestClient]:
    with open_client(database) as opened:
        add_recording(opened, single_axis(1))
        assert opened.post(UNIT, json={"model": "ojeda2000"}).status_code == 201
        yield opened


def at(client: TestClient, rate: float, warm: float, *, grid: bool = False) -> Any:
    place = {"rate_dps": rate, "temperature_c": warm, "grid": grid}
    return client.get(f"{UNIT}/1/uncertainty", params=place).json()


def test_the_answer_has_a_line_for_every_source_and_one_u(client: TestClient) -> None:
    answer = at(client, 80, 35)
    budget, along = answer["budget"]["z"], answer["axes"]["z"]
    assert [line["source"] for line in budget["lines"]] == ["coefficients", "model", "repeatability", *STANDARDS]
    assert [line["type"] for line in budget["lines"]] == ["A", "A", "B", *["B"] * 6]
    assert budget["expanded"] == along["expanded_dps"] == pytest.approx(2 * along["combined_dps"])
    assert budget["combined"] ** 2 == pytest.approx(sum(line["contribution"] ** 2 for line in budget["lines"]))
    by_source = {line["source"]: line for line in budget["lines"]}
    assert by_source["clock"]["contribution"] == pytest.approx(80 * 2e-6)  # 4 ppm with k = 2
    assert by_source["clock"]["common_to_all_rates"]
    assert by_source["thermometer"]["contribution"] == 0  # the unit's own thermometer
    assert answer["not_stated"] == []
    assert not answer["overdue"]
    named = answer["coefficients"]["z"]
    assert set(named) == {"bias", "scale_factor"}
    assert named["scale_factor"]["unit"] == "1"


def test_the_document_bounds_what_is_served_over_the_range(client: TestClient) -> None:
    document = client.get(f"{UNIT.removesuffix('s')}?version=1").json()
    stated = document["uncertainty"]["axes"]["z"]
    cells = [cell for row in at(client, 0, 35, grid=True)["grid"]["axes"]["z"] for cell in row]
    assert stated["bound_dps"] == max(cell["expanded_dps"] for cell in cells)
    there = at(client, stated["rate_dps"], stated["temperature_c"])
    assert there["budget"]["z"] == stated["budget"]
    assert [each["quantity"] for each in document["standards"]["stated"]] == STANDARDS
    assert document["standards"]["stated"][0]["certificate"] == "SIM-CLOCK-1"
    at_c = document["uncertainty"]["coefficients_at_c"]
    served = at(client, 0, at_c)["coefficients"]["z"]["scale_factor"]
    assert stated["coefficients"]["scale_factor"] == {
        name: served[name] for name in ("value", "unit", "combined", "effective_degrees_of_freedom", "k", "expanded")
    }


def test_exported_files_state_the_bound(client: TestClient) -> None:
    document = client.get(f"{UNIT.removesuffix('s')}?version=1").content
    calibration = read_calibration(document)
    (bound,) = bounds_dps(calibration).values()
    assert bound is not None
    header = export_calibration(document, "c")[0].decode()
    line = next(line for line in header.splitlines() if "_u_dps[" in line)
    stated = float(line.partition("{")[2].partition("}")[0])
    assert bound <= stated <= 1.1 * bound
    said = "Expanded uncertainty U (95.45 %) of a corrected rate on later days, about its own axis alone, at most"
    assert f"{said}: z {stated:g} deg/s." in header
    assert "U turned about any axis: unknown for z." in header  # it was turned about z alone
    assert re.search(r"_u_any_axis_dps\[1\] = \{NAN\};", header)


def test_the_figure_draws_every_contribution_as_served(client: TestClient) -> None:
    over = at(client, 0, 35, grid=True)["grid"]["contributions"]
    figure = contributions(over)
    panels = {"x": over["z"]["over_rate"], "x2": over["z"]["over_temperature"]}
    for panel, lines in panels.items():
        drawn = {trace.name: trace for trace in figure.data if trace.xaxis == panel}
        expected = {**lines["contributions"], "combined u": lines["combined"], "expanded U": lines["expanded"]}
        assert set(drawn) == {f"{name}, deg/s" for name in expected}
        for name, values in expected.items():
            assert list(drawn[f"{name}, deg/s"].x) == lines["at"]
            assert list(drawn[f"{name}, deg/s"].y) == values
    shown = [trace.name for trace in figure.data if trace.showlegend]
    assert len(shown) == len(set(shown)) == 3 + len(STANDARDS) + 2
    there = at(client, panels["x"]["at"][3], over["z"]["temperature_c"])
    assert there["budget"]["z"]["expanded"] == panels["x"]["expanded"][3]


def test_the_command_prints_what_http_gives(client: TestClient, database: Path, tmp_path: Path) -> None:
    where = ["--rate-dps", "80", "--temperature-c", "35", "--database", str(database)]
    told = CliRunner().invoke(app, ["uncertainty", "FOG-0001", *where, "--json"])
    assert told.exit_code == 0, told.output
    assert json.loads(told.stdout) == at(client, 80, 35, grid=True)
    figure = tmp_path / "figure.html"
    printed = CliRunner().invoke(app, ["uncertainty", "FOG-0001", *where, "--figure", str(figure)])
    assert printed.exit_code == 0, printed.output
    assert "clock (step clock, certificate SIM-CLOCK-1)" in printed.stdout
    assert f"U = {at(client, 80, 35)['axes']['z']['expanded_dps']:.2g} deg/s (95.45 %)" in printed.stdout
    assert '"name":"clock, deg' in figure.read_text()
    refused = CliRunner().invoke(app, ["uncertainty", "FOG-0001", *where, "--figure", str(tmp_path / "figure.png")])
    assert refused.exit_code == 2
    assert "name a file that ends in .html" in refused.output


@pytest.mark.slow
def test_a_campaign_says_that_a_standard_is_overdue_and_keeps_it(tmp_path: Path) -> None:
    record = read_bench("single-axis-sim").model_dump()
    late = {"quantity": "clock", "u": 2.0, "name": "counter", "due": "2020-01-31"}
    bench = BenchFile.model_validate({**record, "standards": [late]})
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        ended = run(store, prepare(store, "short", bench, VirtualClock(), clip=False))
        assert ended.state == "done", ended.reason
        (event,) = [event for event in store.campaigns.events(ended.id) if event.kind == "standard_overdue"]
        assert (event.level, event.device) == ("warning", "clock")
        info = store.recordings.get(ended.recordings["FOG-0001"]).info
    assert [(each["name"], each["due"]) for each in info["standards"]] == [("counter", "2020-01-31")]
