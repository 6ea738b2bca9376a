"""Real gyros: the independent analyses import no labctl, the page is that of the study, its key numbers hold."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from studies.real import published
from studies.real.answers import Answer, Commands
from studies.real.comparison import Row, compared, figures, rows_of
from studies.real.independent import files, hand_turns, poses, rate_table, rests
from studies.real.independent.files import Value, clustered
from studies.real.page import NOTES, PAGE
from studies.real.recordings import RECORDINGS
from studies.rest_peers import across_legs, ardupilot, printed_parabolas, px4
from studies.rest_units import Hidden, unit_at_rest
from tests.helpers.paths import EXAMPLES, ROOT

INDEPENDENT = ROOT / "studies" / "real" / "independent"
SMALL = ("pan-cooldown", "imucal-annotated", "mpu9150-1", "osu-rate-table")


def test_independent_analyses_import_numpy_scipy_and_each_other_only() -> None:
    allowed = {"numpy", "scipy", "pyarrow", *sys.stdlib_module_names}
    foreign = []
    for path in sorted(INDEPENDENT.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            foreign += [
                f"{path.name}: {name}"
                for name in names
                if name.partition(".")[0] not in allowed and not name.startswith("studies.real.independent")
            ]
    assert not foreign


def test_an_independent_analysis_runs_without_labctl() -> None:
    code = (
        "import sys; from studies.real.independent import hand_turns; hand_turns.annotated(); "
        "sys.exit(any(name.partition('.')[0] in {'labctl', 'instruments'} for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Row]]:
    folder = tmp_path_factory.mktemp("real")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Commands, "verdict", lambda *_: "")  # a criticism takes longer than all else
        return {each.name: compared(each, folder).rows for each in RECORDINGS if each.name in SMALL}


@pytest.mark.slow
def test_labctl_and_the_independent_analyses_agree(small: dict[str, list[Row]]) -> None:
    assert set(small) == set(SMALL)
    counts = {name: sum(not row.is_error for row in rows) for name, rows in small.items()}
    assert counts == dict(zip(SMALL, (6, 12, 12, 4), strict=True))
    for name, rows in small.items():
        assert all(row.agreement in {"yes", "same", "labctl better"} for row in rows), name


@pytest.mark.slow
def test_the_page_has_the_numbers_of_the_study(small: dict[str, list[Row]]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name, rows in small.items():
        section = text.partition(f"### {name}\n")[2].partition("###")[0]
        for row in rows:
            shown = f"| {row.quantity} | {figures(row.labctl)} | {figures(row.independent)} |"
            assert shown in section, "write the page again: python -m studies.real.write"
    assert all(f"### {each.name}\n" in text for each in RECORDINGS)
    assert NOTES in text


def test_agreement_with_published_values_is_classified(small: dict[str, list[Row]]) -> None:
    worse = Row("error, deg/s", Value(1.2), Value(1.0))
    assert worse.agreement == "labctl worse"
    assert Row("error, deg/s", Value(0.8), Value(1.0)).agreement == "labctl better"
    assert Row("bias, deg/s", Value(1.0, 0.1), Value(0.79, 0.1)).agreement == "no"
    section = PAGE.read_text(encoding="utf-8").partition("## Where labctl is worse")[2].partition("## Quantity")[0]
    assert "mpu9150-2, z by rate about x" in section
    assert "pan-cooldown, error at temperatures left out of the fit" in section


def test_quantities_of_both_are_compared() -> None:
    answer = Answer({"a": Value(1.0, 1.0)}, {}, "")
    assert [row.quantity for row in rows_of(answer.found, {"a": Value(0.0), "b": Value(0.0)})] == ["a"]


def test_a_command_that_fails_says_which(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=r"labctl fit NOBODY .*exit"):
        Commands(tmp_path).json("fit", "NOBODY", "--model", "turns")


def test_the_published_matrix_of_turns_is_that_of_the_independent_analysis() -> None:
    parts, rate_hz = hand_turns.SESSIONS["imucal-annotated"]
    found = hand_turns.analysis(parts(), rate_hz)
    ours = [[found[f"{axis} by rate about {about}, E, 1e-3"].value for about in "xyz"] for axis in "xyz"]
    assert np.array(ours) == pytest.approx(1e3 * published.IMUCAL_E, abs=0.03)


def test_the_independent_sine_leaves_what_its_authors_later_surface_left() -> None:
    """Published for a later session of the rig: 5.9e-4 rad/s, 0.034 deg/s; here 0.048 deg/s."""
    assert rate_table.analysis()["error with the sine, deg/s"].value == pytest.approx(0.048, abs=5e-4)


def test_rotations_of_the_independent_analysis_are_rotations() -> None:
    """A quarter turn about z takes y to x; two quarter turns about z and then x are their product."""
    quarter = np.tile([0.0, 0.0, 90.0], (100, 1)), np.full(100, 0.01)
    assert poses.turned(*quarter) @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    both = np.vstack([quarter[0], np.tile([90.0, 0.0, 0.0], (33, 1))]), np.append(quarter[1], np.full(33, 1 / 33))
    then_x = poses.turned(both[0][100:], both[1][100:])
    assert poses.turned(*both) == pytest.approx(poses.turned(*quarter) @ then_x, abs=1e-12)


def test_gravity_of_known_rests_is_found() -> None:
    """A simulated accelerometer with an upper triangular matrix and an offset, 12 rests of any direction."""
    rng = np.random.default_rng(2)
    directions = rng.standard_normal((12, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    matrix, offset = np.array([[1.01, 0.02, -0.01], [0, 0.98, 0.015], [0, 0, 1.03]]), np.array([0.05, -0.02, 0.1])
    force = np.repeat(directions @ np.linalg.inv(matrix).T + offset, 10, axis=0)
    session = rests.Session(np.arange(120) / 10.0, np.zeros((120, 3)), force)
    up, found, moved = rests.gravity(session, [slice(10 * k, 10 * k + 10) for k in range(12)])
    assert up == pytest.approx(directions, abs=1e-8)
    assert found == pytest.approx(matrix, abs=1e-8)
    assert moved == pytest.approx(offset, abs=1e-8)


def test_clustered_uncertainty_covers_errors_that_readings_share() -> None:
    """200 draws: 20 clusters of 30 readings share an error; the mean's u is that of 20 numbers, not of 600."""
    rng = np.random.default_rng(3)
    cluster = np.repeat(np.arange(20), 30)
    deviations = []
    for _ in range(200):
        y = rng.standard_normal(20)[cluster] + 0.1 * rng.standard_normal(600)
        values, covariance = clustered(np.ones((600, 1)), y, cluster)
        deviations.append(values[0] / np.sqrt(covariance[0, 0]))
    assert np.std(deviations) == pytest.approx(1.0, abs=0.15)


def test_autopilots_formulas_find_a_cubic() -> None:
    warm = np.linspace(-10.0, 50.0, 30_000)
    rate = 1.0 + 0.01 * warm - 2e-4 * warm**2 + 3e-6 * warm**3
    grid = np.linspace(-8.0, 48.0, 20)
    truth = 1.0 + 0.01 * grid - 2e-4 * grid**2 + 3e-6 * grid**3
    spoilt = rate.copy()
    spoilt[5_000:5_010] += 100.0
    assert px4(warm, spoilt)(grid) == pytest.approx(truth, abs=1e-4)  # its median takes a spike of ten samples out
    assert ardupilot(warm, rate, 2.0)(grid) == pytest.approx(truth, abs=1e-6)
    assert np.abs(ardupilot(warm, spoilt, 2.0)(grid) - truth).max() > 1e-3


def test_labctls_solver_gives_the_printed_parabolas_of_the_warm_up() -> None:
    for ours, theirs in printed_parabolas().values():
        assert ours == pytest.approx(theirs, rel=1e-6)


def test_peers_are_compared_leg_by_leg_on_a_simulated_loop() -> None:
    found = across_legs(unit_at_rest(0, Hidden()))
    assert set(found) == {"PX4", "ArduPilot", "labctl, parabola", "labctl, improved"}
    assert all(0 < rms < 0.002 for rms in found.values())


def test_every_published_file_is_named_with_its_licence() -> None:
    text = (EXAMPLES / "published" / "README.md").read_text(encoding="utf-8")
    for path in files.PUBLISHED.glob("*.*"):
        if path.name != "README.md":
            assert path.name in text or f"`-{path.stem[-1]}`" in text, path.name
    assert sum(path.stat().st_size for path in files.PUBLISHED.rglob("*") if path.is_file()) < 1_200_000
