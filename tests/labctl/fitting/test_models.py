"""What a fit gives back: exactly what was put in, in the right place, with the right unit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting import FittedModel, fit
from labctl.fitting.models.paper_units import in_paper_units
from labctl.fitting.models.temperature import LagrangeTable
from labctl.recording import OutputUnit, Recording

Grid = tuple[np.ndarray, np.ndarray]
Make = Callable[..., Recording]


@pytest.mark.parametrize(("i", "j"), [(i, j) for i in range(4) for j in range(3)])
def test_each_monomial_of_the_surface_lands_in_its_own_coefficient(
    make_points: Make, grid_11_by_11: Grid, i: int, j: int
) -> None:
    output, warm = grid_11_by_11  # the direct law's argument is the output itself
    size = 0.5 / (100.0**i * 45.0**j)
    result = fit(make_points(output - size * output**i * warm**j, warm, output), "ojeda2000")
    paper = in_paper_units(result.fitted)["ojeda2000"]["z"]
    for name, value in paper.items():
        a, b = (int(part) for part in name[2:-1].split(","))
        assert value * 100.0**a * 45.0**b == pytest.approx(0.5 if (a, b) == (i, j) else 0.0, abs=1e-8), name
    assert result.error.rms_dps == pytest.approx(0.0, abs=1e-10)


def test_the_direct_law_is_subtracted(make_points: Make, grid_11_by_11: Grid) -> None:
    output, warm = grid_11_by_11
    true = output - (0.3 + 0.01 * output + 1e-6 * output**3 + 0.002 * output * (warm - 35) / 10)
    result = fit(make_points(true, warm, output), "ojeda2000")
    assert result.error.raw_rms_dps == pytest.approx(np.sqrt(np.mean((output - true) ** 2)))
    assert result.error.heldout_rms_dps == pytest.approx(0.0, abs=1e-9)


def test_a_forward_law_is_inverted(make_points: Make, grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    output = rate + 0.2 + 0.01 * rate + 2e-6 * rate**3
    result = fit(make_points(rate, warm, output), effects=["bias", "scale_factor", "scale_factor_odd"])
    assert result.error.rms_dps == pytest.approx(0.0, abs=1e-9)
    coefficients = result.to_json()["axes"]["z"]["coefficients"]
    assert coefficients["scale_factor_r3"]["value"] == pytest.approx(2e-6)
    assert coefficients["scale_factor_r3"]["unit"] == "(deg/s)^-2"


def test_a_direct_cubic_of_a_forward_cubic_leaves_a_false_residual(make_points: Make, grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    recording = make_points(rate, warm, rate + 0.01 * rate + 2e-6 * rate**3)
    direct = fit(recording, "ojeda2000").error.rms_dps
    assert direct is not None
    assert 0.0005 < direct < 0.02


def test_only_turning_about_y_moves_only_the_y_inputs(triaxial: Callable[[int], object]) -> None:
    recording = triaxial(1).campaign(1, white=1e-9, drift=0.0)  # type: ignore[attr-defined]
    unit = triaxial(1)
    result = fit(recording, "yang2018")
    nodes = result.fitted.model.temperature.nodes_c  # type: ignore[union-attr]
    rows = in_paper_units(result.fitted)["yang2018"]
    assert len(rows) == 10
    assert [row["temperature_c"] for row in rows] == pytest.approx(list(nodes))
    k = unit.k(rows[6]["temperature_c"])  # type: ignore[attr-defined]
    for out in range(3):
        for turning in range(3):
            name = f"K{'xyz'[turning]}{'xyz'[out]}"  # the paper's first letter is the axis that turns
            assert rows[6][name] == pytest.approx(k[out, turning], abs=2e-6), name


@pytest.mark.slow
def test_coverage_of_k_and_b(triaxial: Callable[[int], object]) -> None:
    scores = []
    for seed in range(8):
        unit = triaxial(seed)
        result = fit(unit.campaign(seed), "yang2018")  # type: ignore[attr-defined]
        nodes = result.fitted.model.temperature.nodes_c  # type: ignore[union-attr]
        for row, axis in enumerate("xyz"):
            found = result.fitted.axes[axis]
            for name, values, u in zip(found.names, found.values, found.u, strict=True):
                if name == "bias":
                    truth = [unit.bias(t)[row] for t in nodes]  # type: ignore[attr-defined]
                else:
                    column = row if name == "scale_factor" else "xyz".index(name[-1])
                    truth = [unit.k(t)[row, column] - (row == column) for t in nodes]  # type: ignore[attr-defined]
                scores.append((values - np.array(truth)) / u)
    z = np.abs(np.concatenate(scores))
    assert 0.63 < np.mean(z < 1) < 0.74
    assert 0.92 < np.mean(z < 2) < 0.98


@pytest.mark.slow
def test_the_noise_floor_is_white_noise_and_drift_together(triaxial: Callable[[int], object]) -> None:
    error = fit(triaxial(3).campaign(3), "yang2018").error  # type: ignore[attr-defined]
    assert error.noise_floor_dps == pytest.approx(np.hypot(0.01 / np.sqrt(60), 0.0015), rel=0.2)
    assert error.heldout_rms_dps is not None
    assert error.heldout_rms_dps < 1.25 * error.noise_floor_dps


def test_upside_down_turns_the_sign(make_points: Make) -> None:
    rate = np.tile(np.linspace(-100, 100, 11), 2)
    position = np.repeat(["z", "-z"], 11)
    body = np.where(position == "z", rate, -rate)
    recording = make_points(rate, np.full(22, 25.0), 0.5 + 1.01 * body)
    recording.columns["position"] = position  # type: ignore[index]
    coefficients = fit(recording, effects=["bias", "scale_factor"]).to_json()["axes"]["z"]["coefficients"]
    assert coefficients["bias"]["value"] == pytest.approx(0.5)
    assert coefficients["scale_factor"]["value"] == pytest.approx(0.01)


def test_rad_per_second_gives_the_same_fit(make_points: Make, grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    output = 0.2 + 1.003 * rate
    plain = fit(make_points(rate, warm, output), "bias_scale")
    radians = make_points(
        rate, warm, np.radians(output), output={"z": OutputUnit(unit="rad/s", scale=float(np.pi / 180))}
    )
    assert fit(radians, "bias_scale").fitted.axes["z"].values == pytest.approx(plain.fitted.axes["z"].values, abs=1e-12)


def test_the_earth_is_subtracted_where_the_latitude_is_known(make_points: Make, grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    up = 15.041067 / 3600 * np.sin(np.radians(42.28))
    recording = make_points(rate, warm, rate + up + 0.01, latitude_deg=42.28)
    result = fit(recording, effects=["bias"])
    assert result.to_json()["axes"]["z"]["coefficients"]["bias"]["value"] == pytest.approx(0.01, abs=1e-9)
    assert result.environment["earth_rate"] == "subtracted"
    assert "not subtracted" in fit(make_points(rate, warm, rate), effects=["bias"]).environment["earth_rate"]


def test_a_model_survives_its_json(make_points: Make, grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    fitted = fit(make_points(rate, warm, 1.01 * rate), "weiss1995").fitted
    back = FittedModel.from_dict(fitted.to_dict())
    assert back.to_dict() == fitted.to_dict()
    assert np.array_equal(back.axes["z"].covariance, fitted.axes["z"].covariance)


@pytest.mark.parametrize("points", [2, 3])
def test_lagrange_weights_sum_to_one_and_are_exact(points: int) -> None:
    table = LagrangeTable((-40.0, -30.0, -10.0, 0.0, 25.0), points)
    t = np.linspace(-45, 30, 301)
    basis = table.basis(t)
    assert basis.sum(axis=1) == pytest.approx(np.ones(301))
    for power in range(points):
        assert basis @ np.array(table.nodes_c) ** power == pytest.approx(t**power, abs=1e-9)
    assert table.basis(np.array(table.nodes_c)) == pytest.approx(np.eye(5), abs=1e-12)


def test_the_first_interval_uses_the_first_three_nodes() -> None:
    basis = LagrangeTable((0.0, 10.0, 20.0, 30.0)).basis(np.array([5.0, 25.0]))
    assert basis[0, 3] == 0
    assert basis[0, 2] != 0
    assert basis[1, 0] == 0


@pytest.mark.parametrize(
    ("model", "effects", "rates", "temperatures", "said"),
    [
        (
            "ojeda2000",
            [],
            [-50, 0, 50],
            [25, 30, 35],
            r"needs at least 4 different rates; the recording has 3; measure at 1 more rate$",
        ),
        ("ojeda2000", [], [-50, -20, 0, 20, 50], [25, 35], r"needs at least 3 different temperatures.* has 2"),
        (None, ["bias_temperature:3"], [0, 10], [25, 26.4, 26.9, 27.6], r"span 2.60 deg C, too little for order 3"),
        (None, ["scale_factor"], [0.0], [25], r"needs at least 2 different rates; the recording has 1"),
        ("yang2018", [], [-50, 0, 50], [25, 35], r"interpolates between 3 temperatures; the recording has 2"),
    ],
)
def test_too_little_data_says_how_much_more(
    make_points: Make, model: str | None, effects: list[str], rates: list[float], temperatures: list[float], said: str
) -> None:
    rate = np.tile(np.array(rates, dtype=float), len(temperatures))
    warm = np.repeat(np.array(temperatures, dtype=float), len(rates))
    with pytest.raises(NotEnoughData, match=said):
        fit(make_points(rate, warm, rate), model, effects)


@pytest.mark.parametrize(
    ("model", "effects", "said"),
    [
        ("nonsense", [], "error model 'nonsense' is not known; choose one of ojeda2000"),
        (None, ["bais"], "effect 'bais' is not in the catalogue; did you mean bias"),
        (None, ["bias:2"], "has no polynomial order"),
        (None, ["scale_factor_odd:9"], "is not a whole number; give one from 3 to 5"),
        (None, ["bias@knee_dps=3"], "'bias' has no parameter 'knee_dps'; write it without '@'"),
        (None, ["saturation@knee=3"], "has no parameter 'knee'; give one of knee_dps"),
        (None, ["saturation@knee_dps=1e6"], "knee_dps = '1e6' is not a number from 20 to 400 deg/s"),
        (None, ["saturation@knee_dps=nan"], "knee_dps = 'nan' is not a number from 20 to 400 deg/s"),
        (None, ["saturation@knee_dps"], "knee_dps = '' is not a number"),
        (None, ["vibration_rectification@width=0.3"], "the value of centre_dps is missing"),
        (None, [], "give the model to fit"),
    ],
)
def test_unknown_names_are_named(make_points: Make, model: str | None, effects: list[str], said: str) -> None:
    recording = make_points(np.array([0.0, 1.0]), np.array([25.0, 25.0]), np.array([0.0, 1.0]))
    with pytest.raises(BadInput, match=said):
        fit(recording, model, effects)


def test_order_of_data_sets_does_not_matter_without_drift(make_points: Make, grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    rng = np.random.default_rng(1)
    output = 1.01 * rate + 0.1 + rng.normal(0, 1e-6, 121)
    shuffled = rng.permutation(121)
    one = fit(make_points(rate, warm, output), "bias_scale").fitted.axes["z"].values
    other = fit(make_points(rate[shuffled], warm[shuffled], output[shuffled]), "bias_scale").fitted.axes["z"].values
    assert one == pytest.approx(other, abs=1e-6)
