"""`labctl reproduce`: numbers beside the printed ones, figures of every data set, what is missing, and bad input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.error_per_turn import bias_at_rest, error_per_turn
from labctl.fitting import fit, fit_data_of
from labctl.plots import paper_figure
from labctl.recording import Recording, read_recording, to_points
from labctl.services.reproduction import ojeda, yang
from labctl.services.reproduction.findings import Findings
from labctl.services.reproduction.sources import Measured, measured_from, simulated_readings
from tests.helpers.criticism import held
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES


@pytest.fixture(scope="module")
def fog() -> Recording:
    return read_recording(EXAMPLES / "osu-fog")


@pytest.fixture(scope="module")
def triaxial() -> Recording:
    """Return a small campaign of the paper's unit: 84 data sets about three axes."""
    return simulated_readings("quick-triaxial", "yang-paper-sim", sample_rate_hz=2.0)


@pytest.fixture(scope="module")
def of_fog(fog: Recording) -> Findings:
    return ojeda.reproduce(Measured("FOG", "a real gyro", fog, None), None)


def value_of(found: Findings, name: str, of: str) -> float:
    (value,) = (v.value for v in found.values if v.id == name and v.of.startswith(of))
    assert value is not None
    return value


def points_of(found: Findings, figure: str) -> list[tuple[float, float]]:
    """Return the points that the drawn figure has, (x, y)."""
    (made,) = (f for f in found.figures if f["id"].startswith(figure))
    drawn = paper_figure(made)
    return [(x, y) for t in drawn.data if t.mode == "markers" for x, y in zip(t.x, t.y, strict=True)]


def test_a_real_gyros_error_per_turn_before_and_after(fog: Recording, of_fog: Findings) -> None:
    """The paper has a factor of ten; an outside calculation on this recording has 13.3 deg before, 1.4 after."""
    data, result = fit_data_of(fog), fit(fog, "ojeda2000")
    rate, position = data.channels.table_rate_dps(), np.asarray(data.channels["position"]).astype(np.str_)
    fast = np.abs(rate) >= 5
    largest = []
    for error in (data.outputs["z"] - rate, result.residual_dps["z"]):
        bias = bias_at_rest(error, rate, data.temperature_c, position)
        largest.append(np.abs(error_per_turn((error - bias)[fast], rate[fast])).max())
    assert value_of(of_fog, "turn_before", "FOG") == pytest.approx(largest[0])
    assert value_of(of_fog, "turn_after", "FOG") == pytest.approx(largest[1])
    assert largest[0] == pytest.approx(13.3, abs=0.1)
    assert 1.0 < largest[1] < 2.0
    assert value_of(of_fog, "turn_ratio", "FOG") > 10
    assert value_of(of_fog, "turn_after_share", "FOG") < 2.0


def test_every_data_set_is_drawn_where_it_was_measured(fog: Recording, of_fog: Findings) -> None:
    rate = np.asarray(fog.columns["table_rate_dps"], dtype=np.float64)
    error = fog.gyro_dps("z") - rate
    assert points_of(of_fog, "figure-3") == list(zip(rate.tolist(), error.tolist(), strict=True))
    turned = points_of(of_fog, "figure-8")
    assert len(turned) == 2 * np.count_nonzero(np.abs(rate) >= 5)
    (fourth,) = (f for f in of_fog.figures if f["id"].startswith("figure-4"))
    assert len(points_of(of_fog, "figure-4")) == int(fourth["caption"].split()[0]) == 72


def test_every_panel_names_its_quantities_with_units(of_fog: Findings, triaxial: Recording) -> None:
    found = yang.reproduce(measured_from(triaxial, "Q", ""), None)
    panels = [p for f in (*of_fog.figures, *found.figures) for p in f["panels"]]
    assert all(", " in p["x_title"] and ", " in p["y_title"] for p in panels)
    assert [f["id"] for f in found.figures] == [
        "figure-4", "figure-5", "figure-6", "figure-7-before", "figure-7-after", "figure-8", "figure-9",
    ]  # fmt: skip
    assert [len(f["panels"]) for f in found.figures] == [3, 6, 3, 9, 9, 9, 9]


def test_the_papers_unit_measured_gives_the_papers_k_and_errors(triaxial: Recording) -> None:
    found = yang.reproduce(measured_from(triaxial, "Q", ""), None)
    assert value_of(found, "proposed_Kyx", "Q") == pytest.approx(0.0188, abs=2e-5)
    assert value_of(found, "proposed_Kzx", "Q") == pytest.approx(0.0012, abs=2e-5)
    points = to_points(triaxial)
    levels = fit_data_of(points).levels
    assert levels is not None
    warm = np.asarray(points.columns["temperature_c"], dtype=np.float64)
    nearest = min(set(levels.tolist()), key=lambda level: abs(float(warm[levels == level].mean()) - 25.0))
    here = (levels == nearest) & (np.asarray(points.columns["position"]) == "x")
    raw = points.gyro_dps("y")[here]
    assert value_of(found, "table4_x_y_uncompensated", "Q") == pytest.approx(float(np.sqrt(np.mean(raw**2))), abs=5e-3)
    means = [v for v in found.values if v.id.startswith("table4_z")]
    assert {v.why for v in means} >= {"a mean, since the paper prints means here"}


def test_what_one_axis_cannot_give_is_named_with_what_to_record(fog: Recording) -> None:
    found = yang.reproduce(Measured("FOG", "", fog, None), None)
    assert not found.figures
    (missing,) = found.missing
    assert "needs discrete temperature levels" in missing.why
    assert "table1-x-table2" in missing.record


@pytest.mark.slow
def test_the_model_of_yang_2018_stalls_and_criticism_names_the_nonlinearity() -> None:
    campaign = simulated_readings("yang-23-rates", "yang-paper-sim", sample_rate_hz=1.0)
    result = fit(to_points(campaign), "yang2018")
    assert result.error.rms_dps is not None
    assert result.error.noise_floor_dps is not None
    assert result.error.rms_dps > 20 * result.error.noise_floor_dps
    verdict = held(campaign, "yang2018").verdict
    assert (verdict.form, verdict.groups) == ("missing", (("scale_factor_odd",),))
    better = fit(to_points(campaign), "yang2018", ["scale_factor_odd:3"])
    assert better.error.rms_dps is not None
    assert better.error.rms_dps < 1.1 * result.error.noise_floor_dps


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    return Lab(tmp_path_factory.mktemp("papers"))


@pytest.fixture(scope="module")
def weiss(lab: Lab) -> Any:
    return lab.json("reproduce", "weiss1995", "--out", str(lab.folder / "out"))


def test_the_page_stands_alone_and_its_numbers_are_those_printed_as_json(lab: Lab, weiss: Any) -> None:
    page = (lab.folder / "out" / "weiss1995.html").read_text(encoding="utf-8")
    assert json.loads((lab.folder / "out" / "weiss1995.json").read_text(encoding="utf-8")) == weiss
    assert 'src="' not in page.split("<script>")[0]
    assert "<link" not in page
    shown = page.split("<script")[0]
    for number in weiss["numbers"]:
        assert number["quantity"] in shown
        known = number["printed"] is not None and number["reproduced"] is not None
        expected = number["reproduced"] - number["printed"] if known else None
        assert number["difference"] == (None if expected is None else pytest.approx(expected))
        assert number["why"]
        assert number["origin"] in (
            {"measured", "simulated", "built in", "computed"} if number["reproduced"] is not None else {""}
        )
        assert f"<td>{number['origin']}</td>" in shown.replace(' class="words"', "")
    assert sorted(p.name for p in (lab.folder / "out").iterdir()) == ["weiss1995.html", "weiss1995.json"]


def test_the_reports_table_comes_back_and_its_drift_holds(weiss: Any) -> None:
    own = [
        n for n in weiss["numbers"] if n["of"] == "WEISS-ENV05S" and n["place"] in {"Scale factors", "Offsets at rest"}
    ]
    assert len(own) == 12
    assert all(abs(n["difference"]) < 1e-9 for n in own)
    (drift,) = (n for n in weiss["numbers"] if n["quantity"].startswith("largest drift"))
    assert 0 < drift["reproduced"] < drift["printed"] == 1.0


def test_a_user_follows_the_same_drift_on_the_command_line(lab: Lab, weiss: Any) -> None:
    rest = lab.folder / "rest"
    lab.run("simulate", "gyrostar-at-rest", "--bench", "gyrostar-sim", "--out", str(rest))
    lab.run("import", str(rest))
    asked = ["orientation", "GYROSTAR-0001", "--version", "0", "--warm-up-s", "600", "--stop-every-s", "120"]
    legs = lab.json(*asked)["drift_between_stops_deg_per_min"]
    (drift,) = (n for n in weiss["numbers"] if n["quantity"].startswith("largest drift"))
    assert max(map(abs, legs)) == pytest.approx(drift["reproduced"], rel=1e-6)
    assert "deg/min" in lab.run(*asked).stdout


@pytest.mark.slow
def test_a_units_own_recording_is_held_against_the_paper(lab: Lab) -> None:
    lab.run("import", str(EXAMPLES / "osu-fog"))
    answer = lab.json("reproduce", "ojeda2000", "OSU-FOG-2024", "--out", str(lab.folder / "own"))
    assert answer["serial"] == "OSU-FOG-2024"
    assert isinstance(answer["recording"], int)
    assert {n["of"] for n in answer["numbers"]} >= {"OSU-FOG-2024"}
    assert any("Figure 1" in m["what"] and "rate 0" in m["record"] for m in answer["missing"])
    text = lab.run("reproduce", "ojeda2000", "OSU-FOG-2024", "--out", str(lab.folder / "own")).stdout
    assert "not made: Figure 1" in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["ojeda2001"], "paper 'ojeda2001' is not known; choose one of ojeda2000, yang2018, weiss1995"),
        (["ojeda2000", "NOBODY"], "NOBODY"),
        (["yang2018", "OSU-FOG-2024", "--axis", "z"], "uses all axes of the recording together"),
        (["ojeda2000", "OSU-FOG-2024", "--axis", "x"], "the recording has axes z"),
        (["ojeda2000", "--axis", "z"], "choose from the data of a unit"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(lab: Lab, weiss: Any, arguments: list[str], said: str) -> None:
    lab.run("import", str(EXAMPLES / "osu-fog"))
    out = lab.folder / "bad"
    reported = lab.run("reproduce", *arguments, "--out", str(out), status=2)
    assert said in reported.stderr
    assert len(reported.stderr.strip().splitlines()) == 1
    assert not out.exists()


def test_a_folder_of_other_files_is_refused_and_stays(lab: Lab) -> None:
    out = lab.folder / "taken"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    reported = lab.run("reproduce", "weiss1995", "--out", str(out), status=2)
    assert "contains 'notes.txt'" in reported.stderr
    assert [p.name for p in out.iterdir()] == ["notes.txt"]
    reported = lab.run("reproduce", "weiss1995", "--out", str(out / "notes.txt"), status=2)
    assert "is a file" in reported.stderr


def test_an_interrupted_write_leaves_nothing(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    lab.run("reproduce", "weiss1995", "--out", str(lab.folder / "full"), status=2)
    monkeypatch.undo()
    assert not (lab.folder / "full").exists()
    assert not [p.name for p in lab.folder.iterdir() if p.name.startswith(".full")]


@pytest.mark.parametrize("name", ["osu-fog", "freeimu-warmup", "imucal-turns", "weiss-gyrostar"])
def test_every_paper_says_of_every_kind_of_recording_what_it_lacks(lab: Lab, name: str) -> None:
    serial = lab.json("import", str(EXAMPLES / name))["serial"]
    for paper in ("ojeda2000", "yang2018", "weiss1995"):
        answer = lab.json("reproduce", paper, serial, "--out", str(lab.folder / "each"))
        assert all(missing["why"] and missing["record"] for missing in answer["missing"])
        assert answer["missing"]
