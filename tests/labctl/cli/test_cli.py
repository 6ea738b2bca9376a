"""The command line: what it prints, and one clear line with exit status 2 for everything that is wrong."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture(scope="module")
def imported(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    made = Lab(tmp_path_factory.mktemp("imported"))
    made.run("import", str(EXAMPLES / "osu-fog"))
    return made


@pytest.fixture
def fog(imported: Lab, tmp_path: Path) -> Lab:
    return imported.copy(tmp_path)


def test_import_says_what_came_in(lab: Lab) -> None:
    assert lab.json("import", str(EXAMPLES / "osu-fog")) == {
        "serial": "OSU-FOG-2024", "recording": 1, "datasets": 695, "readings": 695, "suggested_model": "ojeda2000",
        "measured_at": "2024-08-01T00:00:00Z", "warnings": [], "left_out": [], "new_unit": True, "similar_unit": None,
    }  # fmt: skip


def test_fit_answers_what_the_contract_says(fog: Lab) -> None:
    answer = fog.json("fit", "OSU-FOG-2024", "--model", "ojeda2000")
    assert answer["serial"] == "OSU-FOG-2024"
    assert answer["version"] == 1
    expected = {"name": "ojeda2000", "effects": ["rate_temperature_surface"], "argument": "output"}
    assert answer["model"].items() >= expected.items()
    assert set(answer["error"]) >= {"raw_rms_dps", "rms_dps", "heldout_rms_dps", "noise_floor_dps"}
    assert answer["error"]["rms_dps"] < answer["error"]["heldout_rms_dps"] < 0.1 < answer["error"]["raw_rms_dps"]
    assert len(answer["axes"]["z"]["coefficients"]) == 12
    assert set(answer["axes"]["z"]["coefficients"]["c_r0_t0"]) == {"value", "u", "unit"}
    assert answer["validity"]["rate_dps"][0] < -100 < 100 < answer["validity"]["rate_dps"][1]


def test_effects_with_orders_are_a_complete_model(fog: Lab) -> None:
    answer = fog.json("fit", "OSU-FOG-2024", "--effects", "bias,scale_factor,bias_temperature:1")
    assert answer["model"]["effects"] == ["bias", "scale_factor", "bias_temperature"]
    assert answer["model"]["argument"] == "rate"
    added = fog.json("fit", "OSU-FOG-2024", "--model", "bias_scale", "--effects", "scale_factor_odd:5")
    assert added["model"]["effects"][-1] == "scale_factor_odd"
    assert added["version"] == 2


@pytest.mark.slow
def test_from_import_to_a_corrected_file(fog: Lab) -> None:
    fog.run("fit", "OSU-FOG-2024", "--model", "ojeda2000")
    refused = fog.run("calibration", "OSU-FOG-2024", status=1)
    assert "no certified calibration" in refused.stderr
    fog.run("certify", "OSU-FOG-2024", "1", "--by", "A", "--reason", "fits")
    file = fog.folder / "fog.json"
    fog.run("calibration", "OSU-FOG-2024", "--out", str(file))
    raw = fog.folder / "raw.csv"
    raw.write_text("t_s,gyro_z,temperature_c\n0.0,-1.4,40\n0.1,-1.4,40\n0.2,-1.4,90\n")
    out = fog.folder / "out.csv"
    answer = fog.json("compensate", str(file), str(raw), str(out))
    assert (answer["rows"], answer["outside"]) == (3, 1)
    rows = out.read_text().splitlines()
    assert rows[0].replace('"', "").split(",")[-2:] == ["rate_z_dps", "outside"]
    assert float(rows[1].split(",")[3]) == pytest.approx(51.0, abs=2.0)
    fog.run("compensate", str(file), str(raw), str(out), "--outside", "refuse", status=2)


@pytest.mark.slow
def test_the_table_of_units_says_what_the_answer_says(fog: Lab) -> None:
    serial = "OSU-FOG-2024"
    fog.run("batches", "set", "B-7", serial, "--by", "A")
    fog.run("fit", serial, "--model", "ojeda2000")
    fog.run("certify", serial, "1", "--by", "A", "--reason", "B", "--due-days", "36500")
    (unit,) = fog.json("units")
    (error,) = unit["newest_errors"]["over_floor"]
    heads, row = (line for line in fog.run("units").stdout.splitlines() if line.strip())
    assert " ".join(heads.split()) == "unit type batch recordings versions error / floor in force certified as due"
    words = [
        serial,
        unit["model"],
        "B-7",
        "1",
        "1",
        f"{error:.4g}",
        "version 1",
        unit["certified_verdict"],
        unit["due"][:10],
    ]
    assert row.split() == " ".join(words).split()


def test_a_published_table_becomes_a_calibration(lab: Lab) -> None:
    assert lab.json("import", str(EXAMPLES / "weiss-gyrostar"))["datasets"] == 0
    table = lab.json("fit", "WEISS-ENV05S", "--model", "weiss1995")["axes"]["z"]["coefficients"]
    assert table["temperature_c"] == [16.0, 18.0, 19.5, 22.0, 23.0, 45.0]
    assert table["bias"]["value"][0] == pytest.approx((2.428 - 2.5) / 0.022)
    assert table["scale_factor"]["value"][4] == pytest.approx(22.078 / 22.0 - 1)
    assert "fit it with --model weiss1995" in lab.run("fit", "WEISS-ENV05S", "--model", "ojeda2000", status=2).stderr


@pytest.mark.slow
def test_export_and_import_again_give_the_same_fit(fog: Lab) -> None:
    fog.run("export", "recording", "1", "--out", str(fog.folder / "out"))
    fog.run("import", str(fog.folder / "out"))
    one, two = (
        fog.json("fit", "OSU-FOG-2024", "--model", "ojeda2000", "--recording", number)["axes"] for number in "12"
    )
    assert one == two


@pytest.mark.slow
def test_simulate_hides_an_effect(lab: Lab) -> None:
    plain = lab.json("simulate", "short", "--out", str(lab.folder / "a"), "--seed", "4")
    hidden = lab.json("simulate", "short", "--out", str(lab.folder / "b"), "--seed", "4", "--hide", "bias=0.7")
    assert hidden["hidden"] == {"bias": 0.7}
    assert plain["readings"] == hidden["readings"]
    biases = []
    for folder in "ab":
        lab.run("import", str(lab.folder / folder))
        answer = lab.json("fit", plain["serial"], "--effects", "bias,scale_factor")
        biases.append(answer["axes"]["z"]["coefficients"]["bias"]["value"])
    assert biases[1] - biases[0] == pytest.approx(0.7, abs=1e-6)


@pytest.mark.slow
def test_a_campaign_from_plan_to_status(lab: Lab) -> None:
    plan = lab.json("campaign", "plan", "table1-x-table2")
    assert plan["datasets"] == 630
    started = lab.json("campaign", "start", "short")
    assert started["state"] == "done"
    assert started["progress"] == 1.0
    status = lab.json("campaign", "status")
    assert status["id"] == started["id"]
    assert [c["id"] for c in lab.json("campaign", "list")] == [1]


def _edited(lab: Lab) -> list[str]:
    lab.run("fit", "OSU-FOG-2024", "--model", "ojeda2000")
    file = lab.folder / "edited.json"
    lab.run("calibration", "OSU-FOG-2024", "--version", "1", "--out", str(file))
    file.write_text(file.read_text().replace('"version":1', '"version":2'))
    raw = lab.folder / "raw.csv"
    raw.write_text("gyro_z,temperature_c\n0,40\n")
    return ["compensate", str(file), str(raw), str(lab.folder / "out.csv")]


def _recipe(lab: Lab, text: str) -> str:
    path = lab.folder / "recipe.toml"
    path.write_text(text)
    return str(path)


WRONG_KEY = 'format = "labctl-recipe/1"\nname = "x"\ntemperature_c = [25]\nrates_dps = [1]\npositions = ["z"]\n'
TOO_FAST = 'format = "labctl-recipe/1"\nname = "x"\ntemperatures_c = [25]\nrates_dps = [1, 900]\npositions = ["z"]\n'


HEAD = """format = "labctl-recording/1"
serial = "BAD-1"
axes = ["z"]
kind = "{kind}"
started_at = "2026-01-05T08:00:00Z"
{extra}
[output.z]
unit = "deg/s"
"""
POINTS = "dataset,t_s,table_rate_dps,temperature_c,gyro_z"


def _recording(lab: Lab, lines: list[str], *, kind: str = "points", head: str = POINTS, extra: str = "") -> Path:
    """Write a recording of a unit BAD-1 with these rows."""
    folder = lab.folder / "bad"
    folder.mkdir()
    (folder / "recording.toml").write_text(HEAD.format(kind=kind, extra=extra))
    (folder / f"{kind}.csv").write_text("\n".join([head, *lines]) + "\n")
    return folder


def _grid(rates: list[float], temperatures: list[float]) -> list[str]:
    pairs = [(rate, warm) for warm in temperatures for rate in rates]
    return [f"{i + 1},{60 * i},{rate},{warm},{1.01 * rate + 0.1}" for i, (rate, warm) in enumerate(pairs)]


def _import(lines: list[str], head: str = POINTS, kind: str = "points", extra: str = "") -> Any:
    return lambda lab: ["import", str(_recording(lab, lines, head=head, kind=kind, extra=extra))]


def _fit(rates: list[float], temperatures: list[float]) -> Any:
    def arguments(lab: Lab) -> list[str]:
        lab.run("import", str(_recording(lab, _grid(rates, temperatures))))
        return ["fit", "BAD-1", "--model", "ojeda2000"]

    return arguments


def _truncated(lab: Lab) -> list[str]:
    lab.run("export", "recording", "1", "--out", str(lab.folder / "out"))
    parquet = lab.folder / "out" / "points.parquet"
    parquet.write_bytes(parquet.read_bytes()[:-100])
    return ["import", str(lab.folder / "out")]


def _newer(lab: Lab) -> list[str]:
    with sqlite3.connect(lab.database) as raw:
        raw.execute("UPDATE alembic_version SET version_num = '9999'")
    raw.close()
    return ["fit", "OSU-FOG-2024", "--model", "ojeda2000"]


def _bad_option(lab: Lab) -> list[str]:
    bench = lab.folder / "bench.toml"
    text = (Path(EXAMPLES).parent / "instruments" / "benches" / "triaxial-sim.toml").read_text()
    bench.write_text(text.replace("sample_rate_hz = 125", "sample_rate_hz = 125\noptions = { datagram = 0x55 }"))
    return ["campaign", "plan", "short", "--bench", str(bench)]


FEW = [-90.0, 0.0, 90.0]
MANY = [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (_import(["1,0,10,25"], head="dataset,t_s,table_rate_dps,temperature_c"), "gyro_z"),
        (_import(["1,0,10,25,nan", "2,60,10,25,1"]), "row 1"),
        (_import(["1,0,10,25,10.1", "2,60,ten,25,10.1"]), "'ten'"),
        (_import(["1,0,10,25,10.1", "2,60,10,22,007,10.1"]), "Expected 5 columns, got 6"),
        (_import(["1,60,10,25,10.1", "2,30,10,25,10.1"]), "t_s"),
        (_import(["1,0,10,25,10.1"], extra="colour = 'red'"), "colour"),
        (_truncated, "parquet"),
        (_newer, "9999"),
        (_bad_option, "datagram"),
        (_fit(FEW, [25, 35, 45]), "rates"),
        (_fit(MANY, [25, 25.2, 25.4]), "temperature"),
        (lambda _: ["fit", "NO_SERVICE", "--model", "ojeda2000"], "unit 'NO_SERVICE' is not in this database"),
        (lambda _: ["fit", "OSU-FOG-2024", "--model", "nonsense"], "error model 'nonsense' is not known"),
        (lambda _: ["fit", "OSU-FOG-2024", "--effects", "saturatoin"], "did you mean saturation"),
        (lambda _: ["fit", "OSU-FOG-2024", "--model", "ojeda2000", "--recording", "77"], "recording 77 is not in"),
        (lambda _: ["fit", "OSU-FOG-2024", "--effects", "misalignment"], "axis z"),
        (lambda lab: ["campaign", "plan", _recipe(lab, WRONG_KEY)], "temperature_c"),
        (lambda lab: ["campaign", "plan", _recipe(lab, TOO_FAST)], "900"),
        (lambda _: ["campaign", "plan", "no-such-recipe"], "no-such-recipe"),
        (lambda _: ["campaign", "plan", "short", "--bench", "nowhere.toml"], "nowhere.toml"),
        (_edited, "was edited or damaged"),
        (lambda lab: ["import", str(lab.folder)], "recording.toml: not found"),
        (
            lambda lab: ["simulate", "short", "--out", str(lab.folder / "s"), "--hide", "ghost"],
            "'ghost' cannot be hidden",
        ),
        (lambda _: ["certify", "OSU-FOG-2024", "9", "--by", "A", "--reason", "B"], "no calibration version 9"),
        (lambda _: ["serve", "--host", "0.0.0.0", "--port", "0"], "no API key exists yet"),
        (lambda _: ["serve", "--require-keys", "--port", "0"], "--require-keys, but no API key exists yet"),
        (lambda _: ["serve", "--port", "99999"], "--port 99999: give a port from 1 to 65535, or 0 for a free port"),
    ],
)
def test_what_is_wrong_gets_one_clear_line_and_changes_nothing(fog: Lab, arguments: Any, said: str) -> None:
    given = arguments(fog)
    before = fog.content()
    result = fog.run(*given, status=2)
    assert said in result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    assert result.stdout == ""
    assert fog.content() == before


def test_clip_leaves_out_what_the_bench_cannot_do(lab: Lab) -> None:
    plan = lab.json("campaign", "plan", _recipe(lab, TOO_FAST), "--clip")
    assert plan["datasets"] == 1
    assert "900" in plan["clipped"][0]


def test_a_bench_is_checked(lab: Lab) -> None:
    answer = lab.json("bench", "check", "triaxial-sim")
    assert answer["ok"]
    assert [device["device"] for device in answer["devices"]] == ["table", "chamber", "mems"]
