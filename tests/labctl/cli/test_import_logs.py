"""`labctl import` of logs: the map is shown and asked for, written, given; nothing is kept before it is accepted."""

from __future__ import annotations

from pathlib import Path

import pytest

from labctl.cli import import_dialogue
from tests.helpers.lab import Lab
from tests.helpers.written_logs import at_rest, csv_text, in_poses, moved, resting_ulog

NAMES = "time (s),gyro_x,gyro_y,gyro_z,temperature (degC)"


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "chamber.csv"
    path.write_text(csv_text(at_rest()), encoding="utf-8")
    return path


def test_nothing_is_kept_before_the_map_is_accepted(lab: Lab, log: Path) -> None:
    refused = lab.run("import", str(log), status=2)
    assert "temperature_c" in refused.stdout
    assert "motion rest" in refused.stdout
    assert "add --accept-map to import with this map" in refused.stderr
    assert not (lab.folder / "lab.sqlite").exists()
    taken = lab.run("import", str(log), "--accept-map")
    assert "recording 1 of chamber: 1 data sets, 400 readings" in taken.stdout


def test_json_asks_nothing_and_prints_one_document(lab: Lab, log: Path) -> None:
    assert "--accept-map" in lab.run("import", str(log), "--json", status=2).stderr
    assert lab.json("import", str(log), "--accept-map", "--option", "serial=U-1")["serial"] == "U-1"


def test_a_map_is_written_corrected_and_given(lab: Lab, tmp_path: Path) -> None:
    log, file = tmp_path / "odd.csv", tmp_path / "map.toml"
    log.write_text(csv_text(at_rest(), NAMES), encoding="utf-8")
    refused = lab.run("import", str(log), "--write-map", str(file), status=2)
    assert refused.stderr.count("no unit is given") == 3
    assert f"--map {file}" in refused.stderr
    file.write_text(file.read_text() + '\n[units]\ngyro = { unit = "deg/s" }\n', encoding="utf-8")
    assert "recording 1 of odd" in lab.run("import", str(log), "--map", str(file)).stdout
    assert "exists already" in lab.run("import", str(log), "--write-map", str(file), status=2).stderr


def test_a_map_that_needs_no_correction_is_written_and_nothing_imported(lab: Lab, log: Path, tmp_path: Path) -> None:
    file = tmp_path / "map.toml"
    assert "nothing was imported" in lab.run("import", str(log), "--write-map", str(file)).stderr
    assert not (lab.folder / "lab.sqlite").exists()
    assert 'from = "gyro_x (deg/s)"' in file.read_text()


@pytest.mark.parametrize(("answer", "status"), [(True, 0), (False, 1)])
def test_at_a_terminal_the_map_is_a_question(
    log: Path, monkeypatch: pytest.MonkeyPatch, answer: bool, status: int
) -> None:
    import typer

    from labctl.services.recordings.importers import as_interchange

    monkeypatch.setattr(import_dialogue.sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(import_dialogue.typer, "confirm", lambda *_, **__: answer)
    asked = import_dialogue.Acceptance(log, given=False, accepted=False, out=None, quiet=False)
    if status == 0:
        with as_interchange(log, accept=asked.ask) as folder:
            assert folder.is_dir()
    else:
        with pytest.raises(typer.Exit) as left, as_interchange(log, accept=asked.ask):
            pass
        assert left.value.exit_code == status


def test_several_problems_are_one_line_each(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "odd.csv"
    log.write_text(csv_text(at_rest(), NAMES), encoding="utf-8")
    lines = lab.run("import", str(log), status=2).stderr.strip().splitlines()
    assert "4 problems; nothing was imported:" in lines[0]
    assert [line[:4] for line in lines[1:]] == ["  - "] * 4
    assert "--write-map MAP.toml" in lines[-1]


def test_one_problem_is_one_line(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "flight.csv"
    log.write_text(csv_text(moved()), encoding="utf-8")
    (line,) = lab.run("import", str(log), "--accept-map", status=2).stderr.strip().splitlines()
    assert "free motion without a reference cannot calibrate a gyro; add" in line


def test_a_template_is_printed(lab: Lab) -> None:
    assert lab.run("import", "--template", "turns").stdout.startswith("data set,t (s),position,turn_deg,turn_u_deg,")
    assert "choose one of rates, rest" in lab.run("import", "--template", "flight", status=2).stderr
    assert "name the file or folder" in lab.run("import", status=2).stderr


def test_an_instance_of_a_ulog_is_an_option(lab: Lab, tmp_path: Path) -> None:
    path = resting_ulog(tmp_path / "log.ulg")
    answer = lab.json("import", str(path), "--accept-map", "--option", "instance=1")
    assert answer["serial"] == "00ab12cd-1"
    assert answer["readings"] == 400


def test_a_map_for_a_folder_in_the_interchange_format_is_refused(lab: Lab, log: Path, tmp_path: Path) -> None:
    from tests.helpers.paths import EXAMPLES

    file = tmp_path / "map.toml"
    file.write_text("", encoding="utf-8")
    refused = lab.run("import", str(EXAMPLES / "osu-fog"), "--map", str(file), status=2)
    assert "leave --map out" in refused.stderr


def test_a_log_of_poses_is_kept_without_warnings_about_rates(lab: Lab, tmp_path: Path) -> None:
    log = tmp_path / "poses.csv"
    header = "time (s),wx (deg/s),wy (deg/s),wz (deg/s),ax (m/s2),ay (m/s2),az (m/s2)"
    log.write_text(csv_text(in_poses(), header), encoding="utf-8")
    answer = lab.json("import", str(log), "--accept-map")
    assert (answer["datasets"], answer["readings"], answer["warnings"]) == (1, 3600, [])
