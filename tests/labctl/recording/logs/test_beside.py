"""Files with further columns of the same run: joined by time, or row by row, or refused with what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadFile, BadInput, BadRecording
from labctl.recording.column_map import parse_map
from labctl.recording.logs.beside import joined
from labctl.recording.logs.text import TextOptions, read_text
from labctl.recording.raw_table import RawTable
from labctl.services.recordings.importers import as_interchange
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES
from tests.helpers.written_logs import in_poses

GYRO, ACCEL = "t (s),gx (deg/s),gy (deg/s),gz (deg/s)", "t (s),ax (m/s2),ay (m/s2),az (m/s2)"


def written(path: Path, rows: np.ndarray, header: str = "") -> Path:
    np.savetxt(path, rows, fmt="%.8g", delimiter=",", header=header, comments="")
    return path


def table(path: Path, rows: np.ndarray, header: str = "") -> RawTable:
    return read_text(written(path, rows, header), TextOptions())


def line(n: int, step: float, start: float = 0.0) -> np.ndarray:
    """Times, and a column that is ten times the time."""
    t_s = start + step * np.arange(n)
    return np.column_stack([t_s, 10 * t_s])


def test_two_files_with_names_make_one_recording_without_a_map(tmp_path: Path) -> None:
    rows = in_poses()
    gyro = written(tmp_path / "gyro.csv", rows[:, :4], GYRO)
    accel = written(tmp_path / "accel.csv", rows[:, [0, 4, 5, 6]], ACCEL)
    lab = Lab(tmp_path)
    arguments = ("import", str(gyro), "--beside", str(accel), "--accept-map")
    assert "motion poses" in lab.run(*arguments).stdout
    assert "no column gives the rate or the angle" in lab.run("import", str(gyro), "--accept-map", status=2).stderr


def test_other_times_are_interpolated(tmp_path: Path) -> None:
    found = joined(
        table(tmp_path / "a.csv", line(50, 0.01), "t,a"), [table(tmp_path / "b.csv", line(30, 0.02), "t,b")], None
    )
    assert list(found.columns) == ["t", "a", "b"]
    np.testing.assert_allclose(found.columns["b"].values, found.columns["a"].values, atol=1e-9)
    assert found.rows == 50
    assert found.shown_rows()[1] == ["0.01", "0.1", "0.1"]


def test_columns_without_names_are_called_by_their_file(tmp_path: Path) -> None:
    one, other = (table(tmp_path / f"{name}.log", line(20, 0.01)) for name in ("one", "other"))
    found = joined(one, [other], parse_map('[columns]\nt_s = { from = 1, unit = "s" }\n'))
    assert list(found.columns) == ["column 1", "column 2", "other: column 2"]


def test_a_name_that_is_taken_gets_the_name_of_its_file(tmp_path: Path) -> None:
    one, other = (table(tmp_path / f"{name}.csv", line(20, 0.01), "t,x") for name in ("one", "other"))
    assert list(joined(one, [other], None).columns) == ["t", "x", "other: x"]
    with pytest.raises(BadFile, match="give the files different names"):
        joined(one, [other, other], None)


def test_without_times_rows_belong_together_one_by_one(tmp_path: Path) -> None:
    one, other = (table(tmp_path / f"{name}.csv", line(20, 1.0), "p,q") for name in ("one", "other"))
    assert joined(one, [other], None).columns["other: q"].values[3] == 30.0
    short = table(tmp_path / "short.csv", line(19, 1.0), "p,q")
    with pytest.raises(
        BadFile, match=r"the file has 19 rows and one\.csv has 20, but no column of one\.csv is known to be the time"
    ):
        joined(one, [short], None)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (
            line(50, 0.01, start=3.0),
            (
                r"there is no reading within 5 steps of time 0 of a\.csv \(row 1; 50 rows without a "
                r"reading\): the times of the other file go from 3 to 3\.49"
            ),
        ),
        (line(50, 10.0), r"there is no reading within 5 steps of time .*: the times of the other file"),
        (line(50, 0.01)[::-1], "do not increase from row to row"),
        (
            np.delete(line(50, 0.01), slice(20, 40), axis=0),
            r"within 5 steps of time 0\.25 of a\.csv \(row 26; 10 rows without a reading\)",
        ),
    ],
)
def test_times_that_do_not_belong_together_are_refused(tmp_path: Path, rows: np.ndarray, said: str) -> None:
    one = table(tmp_path / "a.csv", line(50, 0.01), "t,a")
    if rows[1, 0] == 10.0:
        one = table(tmp_path / "a.csv", line(50, 0.01, start=-500.0), "t,a")
    with pytest.raises(BadFile, match=said):
        joined(one, [table(tmp_path / "b.csv", rows, "t,b")], None)


def test_what_is_no_log_has_nothing_beside_it(tmp_path: Path) -> None:
    log = written(tmp_path / "b.csv", line(20, 0.01), "t,b")
    with (
        pytest.raises(BadInput, match="--beside: importer labctl-recording reads one file by itself"),
        as_interchange(EXAMPLES / "osu-fog", beside=[log]),
    ):
        pass
    with pytest.raises(BadRecording, match="not found"), as_interchange(log, beside=[tmp_path / "none.csv"]):
        pass
