"""A bench by TOML alone: descriptions of `examples/line-instruments` on instruments that share no code with labctl."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import serial
import tomli_w

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import ScaledClock, SystemClock
from instruments.errors import RequestRejected
from labctl.services.benches.described_instruments import check_description
from labctl.stop.instruments_stop import stop_instruments
from labctl.store import open_store
from tests.helpers.forked_commands import run_labctl
from tests.helpers.paths import ROOT
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import first_line

SPEED = 3.0
DESCRIPTIONS = ROOT / "examples" / "line-instruments"
RECIPE = """
format = "labctl-recipe/1"
name = "foreign"
temperatures_c = [25, 30]
rates_dps = [-40, 0, 40]
positions = ["z"]
[soak]
hold_s = 3
max_drift_c = 2.0
drift_window_s = 3
timeout_s = 600
[acquire]
duration_s = 6
settle_s = 1
"""


class Foreign:
    """The instruments in a process of their own, and a bench file that names them."""

    def __init__(self, folder: Path, speed: float) -> None:
        for each in DESCRIPTIONS.glob("*.toml"):
            shutil.copy(each, folder)
        command = [sys.executable, str(ROOT / "tests" / "helpers" / "foreign_bench.py"), str(speed)]
        with_input = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.process, self.bench, self.folder = with_input, folder / "bench.toml", folder
        self.at: dict[str, Any] = json.loads(first_line(with_input))
        host = {"host": "127.0.0.1"}
        document: dict[str, Any] = {
            "name": "foreign", "latitude_deg": 42.0,
            "table": {
                "driver": "line-table", "format": "esp301-table.toml", "port": self.at["table"], "max_rate_dps": 60,
                "acceleration_dps2": 60, "reference": "measured",
            },
            "chamber": {
                "driver": "line-chamber", "format": "scpi-chamber.toml", "tcp_port": self.at["chamber"], **host,
                "min_c": 0, "max_c": 60,
            },
            "references": [{
                "driver": "line-reference", "format": "scpi-thermometer.toml", "tcp_port": self.at["thermometer"],
                **host, "u_c": 0.02,
            }],
            "gyros": [{
                "name": "imu", "driver": "stream-format", "format": "serial-csv", "port": self.at["gyro"],
                "serial": "FRN-1", "axes": ["z"], "max_rate_dps": 100, "sample_rate_hz": 50,
            }],
        }  # fmt: skip
        if speed != 1.0:
            document["simulation"] = {"control": f"127.0.0.1:{self.at['control']}", "speed": speed}
        self.bench.write_text(tomli_w.dumps(document))

    def end(self) -> dict[str, Any]:
        """End the instruments; returns the state in which they were left."""
        said, _ = self.process.communicate("", timeout=WAIT_S)
        return dict(json.loads(said))


@pytest.fixture
def foreign(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Foreign]:
    opened = Foreign(tmp_path, getattr(request, "param", 1.0))
    yield opened
    opened.process.kill()
    opened.process.communicate()


@pytest.mark.slow
@pytest.mark.parametrize("foreign", [SPEED], indirect=True)
def test_a_campaign_from_end_to_end(foreign: Foreign) -> None:
    recipe, database = foreign.folder / "recipe.toml", foreign.folder / "x.db"
    recipe.write_text(RECIPE)
    command = ["campaign", "start", str(recipe), "--bench", str(foreign.bench), "--json"]
    run = run_labctl([*command, "--clear-confirmed-by", "a test", "--database", str(database)])
    assert run.returncode == 0, run.stderr
    left = foreign.end()
    assert left["rate_dps"] == 0.0
    assert left["set_f"] == 77.0, "25 deg C, the safe set point"
    with open_store(str(database), write=False) as store:
        found = {name: np.asarray(column) for name, column in store.recordings.points(1).columns.items()}
    assert found["computed_rate_dps"].tolist() == [-40, 0, 40, -40, 0, 40]
    off = np.abs(found["encoder_rate_dps"] - found["computed_rate_dps"])
    assert np.all(off < 4 * found["encoder_rate_u_dps"]), "the table turns exactly as it was asked to"
    forwards, rest, backwards = (found["gyro_z"][found["computed_rate_dps"] == rate].mean() for rate in (40, 0, -40))
    assert (forwards - backwards) / 80 == pytest.approx(1.004, abs=5e-4)
    assert rest == pytest.approx(0.25, abs=0.01)
    assert found["reference_c"] == pytest.approx(found["chamber_setpoint_c"], abs=0.1)


def test_what_turns_is_stopped_by_the_stop_of_labctl(foreign: Foreign) -> None:
    with serial.Serial(foreign.at["table"], timeout=5) as port:
        port.write(b"1MO\r1VA30\r1MV+\r1MD?\r1VA")  # and half a line, as a killed process leaves it
        assert port.read_until(b"\r\n") == b"0\r\n"
    left = stop_instruments(read_bench(foreign.bench).model_dump(mode="json", exclude_none=True))
    assert (left.stands, left.safe, left.text) == (True, True, "table at rest, chamber at its safe set point")
    assert foreign.end()["rate_dps"] == 0.0


def test_every_request_is_tried(foreign: Foreign) -> None:
    for file, *address in (
        ("esp301-table.toml", "--port", foreign.at["table"]),
        ("scpi-chamber.toml", "--host", f"127.0.0.1:{foreign.at['chamber']}"),
        ("scpi-thermometer.toml", "--host", f"127.0.0.1:{foreign.at['thermometer']}"),
    ):
        run = run_labctl(["driver", "test", str(foreign.folder / file), *address, "--move", "--json"])
        answer = json.loads(run.stdout)
        assert answer["ok"], answer
        assert run.returncode == 0
    assert foreign.end()["rate_dps"] == 0.0


@pytest.mark.parametrize("foreign", [SPEED], indirect=True)
def test_finite_moves_and_rates_by_positions_alone(foreign: Foreign) -> None:
    path = foreign.folder / "esp301-table.toml"
    text = path.read_text().replace("run = ", "move = ").replace("{axis}MV{sign}", "{axis}PR{angle:.3f}")
    path.write_text(text[: text.index("[rate]")])
    answer = check_description(str(path), foreign.at["table"], None, move=True, clock=ScaledClock(SPEED))
    assert answer.ok, answer
    assert [each.what for each in answer.checks][-3:] == ["move forwards", "move backwards", "stop in a run"]
    assert foreign.end()["rate_dps"] == 0.0


def test_a_wrong_description_is_found_on_the_instrument(foreign: Foreign) -> None:
    path = foreign.folder / "esp301-table.toml"
    wrong = path.read_text().replace('yes = "1"', 'yes = "done"').replace('"{axis}TV"', '"{axis}TW"')
    path.write_text(wrong)
    run = run_labctl(["driver", "test", str(path), "--port", foreign.at["table"]])
    assert run.returncode == 1
    assert (
        "table: answered '1' to the request to answer [standing], which is not yes = 'done' or no = '0'" in run.stdout
    )
    assert "table: no answer to the request to answer [rate]" in run.stdout
    assert "2 of 5 failed" in run.stdout


def test_a_refusal_is_said_in_the_words_of_the_instrument(foreign: Foreign) -> None:
    document = read_bench(foreign.bench).model_dump(mode="json", exclude_none=True)
    document["table"]["format"]["start"] = ["{axis}SN7"]  # the motor is never switched on
    bench = open_bench(BenchFile.model_validate({**document, "gyros": document["gyros"]}), SystemClock())
    assert bench.table is not None
    assert bench.chamber is not None
    with pytest.raises(RequestRejected, match=r"table: refused to home: '113' after '1OR1'; check its mode and limits"):
        bench.table.home()
    assert bench.chamber.set_temperature_c(31.03) == pytest.approx(31.0, abs=0.06)
    assert bench.chamber.read().alarms == ()
    bench.close()
