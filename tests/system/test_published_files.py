"""From a published file to a calibration in at most three commands: those of the how-to, on the files that it names.

The commands run in this process. The readings come as the project carries them, and as text in the published layout.
"""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from studies.real.published import FREEIMU_WORDS
from tests.helpers.documentation_blocks import FENCE
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES, ROOT
from tests.helpers.profiles import profile_recording, ramp, sweep
from tests.helpers.written_logs import write_ulog

PAGE = ROOT / "docs" / "how-to" / "from-a-file-to-a-calibration.md"
MAX_COMMANDS = 3
#: Files that were published as text -> name, separator, whether it has a header.
TEXTS = {
    "pan-cooldown": ("TVCtest3_7_20.csv", ",", True),
    "imucal-annotated": ("annotated_session.csv", ",", True),
    "imucal-session": ("example_ferraris_session.csv", ",", True),
    "mpu9150-0": ("mpu9150-0.log", " ", False),
}


def blocks() -> dict[str, list[list[str]]]:
    """The commands of each block of the page, split into words, by the file that the first imports."""
    found = {}
    for each in FENCE.finditer(PAGE.read_text(encoding="utf-8")):
        assert each["language"] == "sh"
        commands = [shlex.split(line) for line in each["text"].splitlines()]
        found[Path(commands[0][2]).stem] = commands
    return found


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    (tmp_path / "examples").symlink_to(EXAMPLES)
    monkeypatch.chdir(tmp_path)
    return Lab(tmp_path)


def calibrated(lab: Lab, commands: list[list[str]]) -> dict[str, dict[str, float]]:
    """Run the commands; return axis -> coefficient -> value, of the file that they write."""
    for program, *arguments in commands:
        assert program == "labctl"
        lab.run(*arguments)
    written = json.loads(Path(commands[-1][-1]).read_text(encoding="utf-8"))
    return {axis: {name: one["value"] for name, one in of.items()} for axis, of in written["coefficients"].items()}


def test_each_kind_takes_three_commands_at_most_and_no_script() -> None:
    kinds = blocks()
    assert len(kinds) == 9
    for commands in kinds.values():
        assert len(commands) <= MAX_COMMANDS
        assert [words[:2] for words in commands] == [["labctl", each] for each in ("import", "fit", "calibration")]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pan-cooldown", "imucal-annotated", "imucal-session", "mpu9150-0"])
def test_published_files_are_calibrated(name: str, lab: Lab) -> None:
    found = calibrated(lab, blocks()[name])
    bias = {
        "pan-cooldown": (-3.938, 3.403, 1.661),
        "imucal-annotated": (0.1197, -0.2728, -0.2226), "imucal-session": (-0.599, -0.3695, 0.0588),
        "mpu9150-0": (1.120, -0.387, 1.229),
    }[name]  # fmt: skip
    assert [found[axis]["bias"] for axis in "xyz"] == pytest.approx(bias, abs=2e-3)


@pytest.mark.slow
def test_raw_words_of_a_warm_up_are_calibrated(lab: Lab) -> None:
    """63,792 readings; against the parabolas that their author printed, at 20 deg C."""
    found = calibrated(lab, blocks()["freeimu-warmup"])
    word = (20.0 - 36.53) * 340
    for axis, printed in FREEIMU_WORDS.items():
        assert found[axis]["bias"] == pytest.approx(np.polyval(printed, word) / 16.4, abs=0.01)


@pytest.mark.slow
def test_two_files_are_one_recording(lab: Lab) -> None:
    found = calibrated(lab, blocks()["xsens_gyro"])
    assert found["y"]["misalignment_z"] == pytest.approx(0.0530, abs=5e-4)
    assert found["z"]["misalignment_x"] == pytest.approx(-0.0249, abs=5e-4)


@pytest.mark.slow
def test_means_of_a_rate_table_are_calibrated(lab: Lab) -> None:
    calibrated(lab, blocks()["osu-rate-table"])
    error = lab.json("fit", "OSU-FOG-2024", "--model", "ojeda2000")["error"]
    assert error["rms_dps"] == pytest.approx(0.0466, abs=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_the_text_as_published_gives_the_same(name: str, lab: Lab, tmp_path: Path) -> None:
    called, separator, header = TEXTS[name]
    table = pq.read_table(EXAMPLES / "published" / f"{name}.parquet")
    columns = [table[column].to_pylist() for column in table.column_names]
    lines = [separator.join(table.column_names)] if header else []
    lines += [separator.join(str(cell) for cell in row) for row in zip(*columns, strict=True)]
    (tmp_path / called).write_text("\n".join(lines) + "\n", encoding="utf-8")
    packed, column_map = blocks()[name][0][2], blocks()[name][0][4]
    packed_says = lab.json("import", packed, "--map", column_map)
    text_says = lab.json("import", called, "--map", column_map)
    assert {key: packed_says[key] for key in ("datasets", "readings")} == {
        key: text_says[key] for key in ("datasets", "readings")
    }
    first, second = (lab.json("export", "recording", str(one["recording"]), "--out", f"out{k}")
                     for k, one in enumerate((packed_says, text_says)))  # fmt: skip
    both = [pq.read_table(Path(one["folder"]) / "samples.parquet").to_pydict() for one in (first, second)]
    assert both[0].keys() == both[1].keys()
    for column in ("gyro_x", "gyro_y", "gyro_z", "t_s", "dataset"):
        np.testing.assert_allclose(both[0][column], both[1][column], rtol=1e-12)


def write_sweep(path: Path) -> None:
    rates = np.concatenate(
        [ramp(5, 0, 100, 50), ramp(8, 100, -100, 50), ramp(5, -100, 0, 50), sweep(12, 0.2, 5.0, 60, 50)]
    )
    columns = profile_recording(rates, 50.0, delay_s=0.005, scale=0.01, bias_dps=0.3).columns
    names = {"t_s": "time (s)", "gyro_z": "gyro_z (deg/s)", "table_rate_dps": "table rate (deg/s)",
             "temperature_c": "temperature (degC)"}  # fmt: skip
    rows = np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names])
    np.savetxt(path, rows, fmt="%.7g", delimiter=",", header=",".join(names.values()), comments="")


def write_cold_start(path: Path) -> None:
    """A ULog of ten minutes at rest from 5 to 41 deg C; the bias is 0.3 deg/s at 20 deg C and rises by 0.01 deg/s/K."""
    rng = np.random.default_rng(5)
    t_s = np.arange(6000) / 10.0
    warm = 5 + 40 * (1 - np.exp(-t_s / 250))
    rates = 0.3 + 0.01 * (warm - 20)[:, None] + 0.05 * rng.standard_normal((len(t_s), 3))
    rows = np.column_stack([1e6 * (10 + t_s), np.radians(rates), warm])
    write_ulog(path, {("sensor_gyro", 0): (("timestamp", "x", "y", "z", "temperature"), rows)})


@pytest.mark.slow
def test_a_table_whose_rate_changes_is_calibrated(lab: Lab, tmp_path: Path) -> None:
    write_sweep(tmp_path / "sweep.csv")
    found = calibrated(lab, blocks()["sweep"])["z"]
    assert found["scale_factor"] == pytest.approx(0.01, abs=2e-4)
    assert found["bias"] == pytest.approx(0.3, abs=5e-3)


def test_a_log_of_an_autopilot_is_calibrated(lab: Lab, tmp_path: Path) -> None:
    write_cold_start(tmp_path / "cold_start.ulg")
    found = calibrated(lab, blocks()["cold_start"])
    assert [found[axis]["bias_t1"] for axis in "xyz"] == pytest.approx([0.01] * 3, abs=1e-3)
