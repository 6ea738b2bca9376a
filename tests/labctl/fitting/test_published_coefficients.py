"""Published tables of coefficients: every form, in output units, with and without uncertainties."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from labctl.compensator import Compensator
from labctl.errors import BadInput, BadRecording, NotEnoughData
from labctl.fitting import fit
from labctl.fitting.data.channels import Channels
from labctl.recording import read_recording
from tests.helpers.lab import Lab

HEAD = """
format = "labctl-recording/1"
serial = "PAPER"
kind = "coefficients"
max_rate_dps = 400.0
started_at = "2018-01-01T00:00:00Z"
"""
AXES = 'axes = ["x", "y", "z"]\n'
#: Yang et al. 2018 at 25 deg C; signs reconstructed: K[output][input].
K = np.array([[1.0005, 0.0188, 0.0012], [-0.0187, 1.0005, 5.2027e-4], [0.0011, 7.5133e-4, 1.0017]])
B = np.array([-0.0303, -0.0435, -0.0261])
#: Their rates with +-350 deg/s, which the printed RMS values are of.
RATES = np.array([0, *(s * r for r in (0.1, 1, 10, 50, 100, 150, 200, 250, 300, 350, 400) for s in (1, -1))])
COLUMNS = [f"k_{o}{i}" for o in "xyz" for i in "xyz"] + [f"b_{o}" for o in "xyz"]


def table(folder: Path, head: str, columns: list[str], rows: list[list[object]]) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "recording.toml").write_text(HEAD + head)
    lines = [",".join(columns), *(",".join(str(value) for value in row) for row in rows)]
    (folder / "coefficients.csv").write_text("\n".join(lines) + "\n")
    return folder


def matrices(folder: Path, temperatures_c: list[float], scale: float = 1.0, offset: float = 0.0) -> Path:
    output = "".join(f'[output.{a}]\nunit = "V"\nscale = {scale}\noffset = {offset}\n' for a in "xyz")
    rows: list[list[object]] = []
    for temperature_c in temperatures_c:
        k, b = (K + 1e-5 * (temperature_c - 25.0) * np.eye(3)) * scale, B * scale + offset
        rows.append([temperature_c, *k.ravel(), *b])
    return table(folder, AXES + output, ["temperature_c", *COLUMNS], rows)


def test_yangs_published_matrix_leaves_his_printed_errors_and_takes_them_off(tmp_path: Path) -> None:
    result = fit(read_recording(matrices(tmp_path / "t", [25.0])), "single_temperature")
    for turned, other, printed_rms in (("x", "y", 3.9339), ("y", "x", 3.9576)):
        rates = {a: RATES if a == turned else np.zeros(len(RATES)) for a in "xyz"}
        outputs = dict(zip("xyz", K @ np.array(list(rates.values())) + B[:, None], strict=True))
        error = outputs[other] - rates[other]
        assert np.sqrt(np.mean(error**2)) == pytest.approx(printed_rms, rel=2e-3)
        channels = Channels({"temperature_c": np.full(len(RATES), 25.0)}, outputs)
        corrected = result.fitted.compensate(outputs, channels)
        assert max(np.abs(corrected[a] - rates[a]).max() for a in "xyz") < 1e-9


def test_a_table_over_temperature_is_yang2018_in_volts_too(tmp_path: Path) -> None:
    recording = read_recording(matrices(tmp_path / "t", [50.0, -40.0, 0.0, 25.0], scale=0.005, offset=2.5))
    result = fit(recording, "yang2018")
    assert result.temperature_c == (-40.0, 50.0)
    z = result.fitted.axes["z"]
    assert z.names == ("bias", "scale_factor", "misalignment_x", "misalignment_y")
    np.testing.assert_allclose(
        z.values[1], K[2, 2] - 1 + 1e-5 * (np.array([-40.0, 0.0, 25.0, 50.0]) - 25.0), atol=1e-12
    )
    np.testing.assert_allclose(z.values[:, 2], [B[2], K[2, 2] - 1, K[2, 0], K[2, 1]], atol=1e-12)
    assert np.isnan(z.u).all()  # the table states none


def test_uncertainties_are_taken_in_output_units(tmp_path: Path) -> None:
    columns = ["temperature_c", "scale_factor", "offset", "u_scale_factor", "u_offset"]
    folder = table(
        tmp_path / "t",
        'axes = ["z"]\n[output.z]\nunit = "V"\nscale = -0.02\noffset = 2.5\n',
        columns,
        [[20, -0.02, 2.5, 1e-5, 0.002], [40, -0.0202, 2.6, 2e-5, 0.004]],
    )
    z = fit(read_recording(folder), "weiss1995").fitted.axes["z"]
    assert z.values == pytest.approx(np.array([[0.0, -5.0], [0.0, 0.01]]))
    assert z.u == pytest.approx(np.array([[0.1, 0.2], [5e-4, 1e-3]]))


@pytest.mark.parametrize(("i", "j"), [(0, 0), (1, 0), (3, 0), (0, 2), (2, 1)])
def test_each_power_of_ojedas_matrix_stands_where_it_is_named(tmp_path: Path, i: int, j: int) -> None:
    cells = [f"c_r{a}_t{b}" for a in range(4) for b in range(3)]
    values = [0.001 if cell == f"c_r{i}_t{j}" else 0.0 for cell in cells]
    columns = ["reference_c", "temperature_low_c", "temperature_high_c", *cells]
    folder = table(tmp_path / "t", 'axes = ["z"]\n', columns, [[35.0, 25.0, 45.0, *values]])
    result = fit(read_recording(folder), "ojeda2000")
    output, temperature_c = np.array([-4.0, 7.0]), np.array([30.0, 41.0])
    corrected = result.fitted.compensate({"z": output}, Channels({"temperature_c": temperature_c}, {"z": output}))
    np.testing.assert_allclose(output - corrected["z"], 0.001 * output**i * (temperature_c - 35.0) ** j, atol=1e-12)
    assert result.temperature_c == (25.0, 45.0)


def test_polynomials_in_temperature_are_the_simple_models(tmp_path: Path) -> None:
    span: list[object] = [20.0, -10.0, 50.0]
    columns = ["reference_c", "temperature_low_c", "temperature_high_c", "b_t0", "b_t1", "b_t2", "k_t0", "k_t1"]
    volts = 'axes = ["z"]\n[output.z]\nunit = "V"\nscale = 0.02\noffset = 2.5\n'
    folder = table(tmp_path / "t", volts, columns, [[*span, 2.51, 1e-3, -2e-5, 0.0202, 1e-5]])
    result = fit(read_recording(folder), "bias_scale")
    rate, warm = np.array([-40.0, 0.0, 60.0]), np.array([-5.0, 20.0, 45.0])
    u = warm - 20.0
    volt = 2.51 + 1e-3 * u - 2e-5 * u**2 + (0.0202 + 1e-5 * u) * rate
    output = {"z": (volt - 2.5) / 0.02}
    corrected = result.fitted.compensate(output, Channels({"temperature_c": warm}, output))
    np.testing.assert_allclose(corrected["z"], rate, atol=1e-9)
    assert result.temperature_c == (-10.0, 50.0)
    result = fit(
        read_recording(
            table(tmp_path / "b", volts, [*columns[:5], "u_b_t0", "u_b_t1"], [[*span, 2.5, 1e-3, 0.01, 0.001]])
        ),
        "bias_temperature",
    )
    assert result.fitted.axes["z"].u == pytest.approx(np.array([[0.5], [0.05]]))
    bias = fit(
        read_recording(table(tmp_path / "c", 'axes = ["x", "y"]\n', ["axis", "b_t0"], [["x", 0.5], ["y", -0.25]])),
        "bias",
    )
    assert [float(bias.fitted.axes[a].values[0, 0]) for a in "xy"] == [0.5, -0.25]
    with pytest.raises(BadRecording, match="column 'reference_c' is missing; a table of the form 'polynomials in temp"):
        read_recording(table(tmp_path / "d", volts, ["b_t0", "b_t1"], [[2.5, 1e-3]]))
    with pytest.raises(BadRecording, match="'b_t3' is not known in a table of the form 'polynomials in temperature'"):
        read_recording(
            table(tmp_path / "e", volts, [*columns, "b_t3"], [[*span, 2.51, 1e-3, -2e-5, 0.0202, 1e-5, 0.1]])
        )


def test_an_unknown_column_is_refused_with_what_to_write_instead(tmp_path: Path) -> None:
    columns = ["temperature_c", "scale_factor", "offset", "misalignment_x"]
    folder = table(tmp_path / "t", 'axes = ["z"]\n', columns, [[20, 1, 0, 0.0188], [40, 1, 0, 0.0188]])
    with pytest.raises(BadRecording, match=r"'misalignment_x' is not known .* remove or rename it. .* given as k_xy"):
        read_recording(folder)


@pytest.mark.parametrize(
    ("without", "said"),
    [("k_xy", "column 'k_xy' is missing; a table of the form 'matrix K and bias B'"), ("temperature_c", "is missing")],
)
def test_a_table_with_a_gap_is_refused(tmp_path: Path, without: str, said: str) -> None:
    columns = [name for name in ["temperature_c", *COLUMNS] if name != without]
    with pytest.raises(BadRecording, match=said):
        read_recording(table(tmp_path / "t", AXES, columns, [[1.0] * len(columns)]))


def test_a_wrong_or_missing_uncertainty_is_refused(tmp_path: Path) -> None:
    columns = ["temperature_c", "scale_factor", "offset", "u_scale_factor", "u_offset"]
    rows: list[list[object]] = [[20, 1, 0, 0.1, 0.1], [40, 1, 0, 0.1, -0.1]]
    with pytest.raises(BadRecording, match=r"'u_offset', row 2: -0.1; a standard uncertainty is at least 0"):
        read_recording(table(tmp_path / "t", 'axes = ["z"]\n', columns, rows))
    with pytest.raises(BadRecording, match="'u_scale_factor' is missing, although column 'u_offset' is present"):
        read_recording(table(tmp_path / "u", 'axes = ["z"]\n', [*columns[:3], "u_offset"], [[*r[:3], 1] for r in rows]))


def test_another_model_than_the_tables_is_refused(tmp_path: Path) -> None:
    one = read_recording(matrices(tmp_path / "one", [25.0]))
    with pytest.raises(BadInput, match="fit it with --model single_temperature or --model yang2018, without further"):
        fit(one, "ojeda2000")
    with pytest.raises(BadInput, match="without further effects"):
        fit(one, "single_temperature", ["dead_band"])
    with pytest.raises(NotEnoughData, match="at least 3 different temperatures"):
        fit(one, "yang2018")


def test_two_rows_for_one_axis_of_a_polynomial_are_refused(tmp_path: Path) -> None:
    columns = ["reference_c", "temperature_low_c", "temperature_high_c", "c_r0_t0", "c_r0_t1", "c_r0_t2"]
    folder = table(tmp_path / "t", 'axes = ["z"]\n', columns, [[35, 25, 45, 1, 0, 0], [35, 25, 45, 2, 0, 0]])
    with pytest.raises(NotEnoughData, match="one row for each axis, found 2"):
        fit(read_recording(folder), "ojeda2000")


def test_from_the_table_to_the_file_that_a_robot_loads(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    imported = lab.json("import", str(matrices(tmp_path / "t", [-40.0, 0.0, 25.0, 50.0])))
    assert imported["suggested_model"] == "yang2018"
    fitted = lab.json("fit", "PAPER", "--model", "yang2018")
    assert fitted["axes"]["x"]["coefficients"]["bias"]["u"] == [None] * 4
    lab.run("calibration", "PAPER", "--version", "1", "--out", str(tmp_path / "c.json"))
    assert json.loads((tmp_path / "c.json").read_text())["serial"] == "PAPER"
    compensator = Compensator.from_file(tmp_path / "c.json")
    rate = np.array([[10.0, -20.0, 30.0]])
    found = compensator.compensate(rate @ K.T + B, np.array([25.0]))
    assert found.rate_dps == pytest.approx(rate, abs=1e-6)
