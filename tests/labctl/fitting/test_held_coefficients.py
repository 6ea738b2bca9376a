"""Held coefficients: restricted least squares and consider covariance, against formulas written out here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.fitting import fit
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.effects import Reference, parse_term
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.held import Fixed
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.held import Held, HeldCoefficient
from labctl.fitting.numeric.drift_noise import NO_DRIFT, Drift, Noise
from labctl.fitting.uncertainty import evidence_of, rate_uncertainty
from labctl.fitting.uncertainty.sensitivity import correction_gain, error_at, response, u_of_fit
from labctl.recording import Recording, RecordingInfo
from tests.helpers.joint_recordings import CENTRE_C, TRUTH, recordings
from tests.helpers.recordings import STARTED, points

NAN = float("nan")
#: Yang et al. 2018 at 25 deg C, K[output][input] and B.
K = np.array([[1.0005, 0.0188, 0.0012], [-0.0187, 1.0005, 5.2027e-4], [0.0011, 7.5133e-4, 1.0017]])
B = np.array([-0.0303, -0.0435, -0.0261])


def one(value: float, u: float = NAN, unit: str = "") -> HeldCoefficient:
    return HeldCoefficient((value,), (u,), unit)


def fixed(axes: Mapping[str, Mapping[str, HeldCoefficient]], reference_c: float | None = None) -> Fixed:
    return Fixed(axes, "known.toml", "a data sheet", reference_c)


def grid(seed: int, noise_dps: float = 2e-3, runs: bool = True) -> Recording:
    """Return 20 means; with `runs` each of a power-on of its own, so that all are independent and equally certain."""
    rng = np.random.default_rng(seed)
    rate, warm = np.tile([-90.0, -40.0, 0.0, 40.0, 100.0], 4), np.repeat([10.0, 20.0, 30.0, 45.0], 5)
    output = rate * 1.004 + 0.2 + 3e-3 * (warm - 25) + rng.normal(0, noise_dps, 20)
    recording = points(rate, warm, output)
    return replace(recording, columns=recording.columns | {"run": np.arange(1, 21)}) if runs else recording


def test_values_and_covariance_are_those_of_least_squares_on_the_reduced_system() -> None:
    recording = grid(1)
    rate, warm = recording.columns["table_rate_dps"], recording.columns["temperature_c"]
    held = {"bias_t1": one(2.9e-3, 4e-4), "scale_factor": one(4.1e-3, 3e-5)}
    effects = ["bias", "bias_temperature:1", "scale_factor", "scale_factor_asymmetry"]
    found = fit(recording, None, effects, fixed=fixed({"z": held}, 25.0)).fitted.axes["z"]

    x, h = np.column_stack([np.ones(20), np.abs(rate)]), np.column_stack([warm - 25.0, rate])
    y = recording.columns["gyro_z"] - rate - h @ [2.9e-3, 4.1e-3]
    values, *_ = np.linalg.lstsq(x, y)
    _, chi2, *_ = np.linalg.lstsq(np.column_stack([x, h]), y)  # what an error of the held values leaves is no noise
    own = np.linalg.inv(x.T @ x) * float(chi2[0]) / 16
    g, u = -np.linalg.pinv(x) @ h, np.diag([4e-4**2, 3e-5**2])
    joint = np.block([[own + g @ u @ g.T, g @ u], [u @ g.T, u]])
    order = [found.names.index(name) for name in ("bias", "asymmetry", "bias_t1", "scale_factor")]
    assert found.values[order, 0] == pytest.approx([*values, 2.9e-3, 4.1e-3], rel=1e-9)
    size = np.sqrt(np.outer(np.diag(joint), np.diag(joint)))
    np.testing.assert_allclose(found.covariance[np.ix_(order, order)] / size, joint / size, atol=1e-9)


def test_beside_a_drift_they_are_those_of_generalised_least_squares() -> None:
    recording = grid(2, runs=False)
    n, std, drift = 100, 0.01, Drift(0.003, 400.0)
    columns = recording.columns | {"gyro_z_std": np.full(20, std), "n": np.full(20, n)}
    data = fit_data_of(replace(recording, columns=columns))
    held = Held({"z": {"scale_factor": HeldCoefficient((4e-3,), (2e-5,), "1", "scale_factor")}})
    model = ErrorModel("m", (parse_term("bias"), parse_term("scale_factor")), held=held)
    solved = solve_axes(data, model, {"z": Noise(drift, std / np.sqrt(n))})

    t_s, rate = recording.columns["t_s"], recording.columns["table_rate_dps"]
    noise = drift.drift_dps**2 * np.exp(-np.abs(t_s[:, None] - t_s) / drift.tau_s) + np.eye(20) * std**2 / n
    weight, one_ = np.linalg.inv(noise), np.ones(20)
    y = recording.columns["gyro_z"] - rate * 1.004
    own = 1 / (one_ @ weight @ one_)
    bias, g = own * (one_ @ weight @ y), -own * (one_ @ weight @ rate)
    both = np.column_stack([one_, rate])
    prior = np.diag([0.0, 2e-5**-2])  # what an error of the held value leaves, to its uncertainty, is no noise
    left = y - both @ np.linalg.solve(both.T @ weight @ both + prior, both.T @ weight @ y)
    scale = max(float(y @ weight @ left) / 19, 1.0)
    assert solved.fits["z"].values[0, 0] == pytest.approx(bias, rel=1e-9)
    expected = np.array([[own * scale + (g * 2e-5) ** 2, g * 2e-5**2], [g * 2e-5**2, 2e-5**2]])
    np.testing.assert_allclose(solved.fits["z"].covariance, expected, rtol=1e-6)


def test_fitted_coefficients_and_corrected_rates_are_within_u_as_often_as_they_should_be() -> None:
    """The held value is the truth and a normal error of its u; asymmetric rates make the bias depend on it."""
    rng = np.random.default_rng(11)
    rate = np.repeat([0.0, 20.0, 60.0, 100.0, 150.0, -20.0, -60.0], 3)
    truth, u, tried = {"bias": 0.2, "scale_factor": 4e-3, "asymmetry": 1e-4}, 2e-5, 200
    inside: dict[str, list[bool]] = {"bias": [], "asymmetry": [], "rate": []}
    terms = tuple(map(parse_term, ("bias", "scale_factor", "scale_factor_asymmetry")))
    error = truth["bias"] + truth["scale_factor"] * rate + truth["asymmetry"] * np.abs(rate)
    recording = points(rate, np.full(len(rate), 25.0), rate)
    columns = recording.columns | {"gyro_z_std": np.full(len(rate), 1e-2), "n": np.full(len(rate), 100)}
    data = fit_data_of(replace(recording, columns=columns))
    for _ in range(tried):
        output = rate + error + rng.normal(0, 1e-3, len(rate))
        given = HeldCoefficient((truth["scale_factor"] + rng.normal(0, u),), (u,), "1", "scale_factor")
        model = ErrorModel("m", terms, held=Held({"z": {"scale_factor": given}}))
        solved = solve_axes(replace(data, outputs={"z": output}), model, {"z": NO_DRIFT})
        fitted = FittedModel(model, solved.fits)
        axis = fitted.axes["z"]
        for name in ("bias", "asymmetry"):
            k = axis.names.index(name)
            inside[name].append(abs(axis.values[k, 0] - truth[name]) < 2 * axis.u[k, 0])
        true = 120.0
        seen = true * (1 + truth["scale_factor"] + truth["asymmetry"]) + truth["bias"]
        channels = Channels({"temperature_c": np.array([25.0])}, {"z": np.array([seen])})
        left = fitted.compensate({"z": np.array([seen])}, channels)["z"][0] - true
        of_error = u_of_fit(error_at("z", {"z": true}), fitted, 25.0)
        assert of_error is not None
        of_rate = of_error * correction_gain(fitted, response(fitted, {"z": true}, 25.0))[0, 0]
        inside["rate"].append(abs(left) < 2 * of_rate)
    shares = {name: float(np.mean(each)) for name, each in inside.items()}
    assert all(0.91 <= share <= 0.98 for share in shares.values()), shares


def test_all_but_one_coefficient_can_be_held() -> None:
    held = {"bias_t1": one(3e-3), "scale_factor": one(4e-3)}
    found = fit(grid(3, 1e-9), None, ["bias", "bias_temperature:1", "scale_factor"], fixed=fixed({"z": held}, 25.0))
    assert found.fitted.axes["z"].values[:, 0] == pytest.approx([0.2, 3e-3, 4e-3], abs=1e-7)


def test_a_published_matrix_is_held_while_the_bias_is_fitted_at_rest() -> None:
    rng = np.random.default_rng(4)
    n, columns = 24, {}
    for axis in range(3):
        columns[f"gyro_{'xyz'[axis]}"] = B[axis] + rng.normal(0, 1e-4, n)
    info = RecordingInfo(serial="Y", axes=("x", "y", "z"), kind="points", started_at=STARTED, max_rate_dps=400.0)
    columns |= {
        "dataset": np.arange(1, n + 1), "t_s": 600.0 * np.arange(n), "position": np.array(["z"] * n),
        "run": np.ones(n, dtype=np.int64), "table_rate_dps": np.zeros(n), "temperature_c": np.full(n, 25.0),
    }  # fmt: skip
    held = {
        out: {
            ("scale_factor" if i == j else f"misalignment_{into}"): one(K[i, j] - (i == j))
            for j, into in enumerate("xyz")
        }
        for i, out in enumerate("xyz")
    }
    recording = Recording(info, columns)
    result = fit(recording, None, ["bias", "scale_factor", "misalignment"], fixed=fixed(held))
    assert result.rate_dps == (-400.0, 400.0)  # all that depends on the rate is published
    for i, axis in enumerate("xyz"):
        coefficients = result.to_json()["axes"][axis]["coefficients"]
        assert coefficients["bias"]["value"] == pytest.approx(B[i], abs=1e-4)  # type: ignore[call-overload, index]
        assert 1e-5 < coefficients["bias"]["u"] < 2e-4  # type: ignore[call-overload, index]
        assert coefficients["scale_factor"]["u"] is None  # type: ignore[call-overload, index]
    rates = rng.uniform(-300, 300, (3, 50))
    outputs = dict(zip("xyz", K @ rates + B[:, None], strict=True))
    corrected = result.fitted.compensate(outputs, Channels({"temperature_c": np.full(50, 25.0)}, outputs))
    assert max(np.abs(corrected[a] - rates[i]).max() for i, a in enumerate("xyz")) < 2e-4


def test_without_u_the_uncertainty_of_a_rate_is_unknown_and_says_why() -> None:
    recording, effects = grid(5), ["bias", "bias_temperature:1", "scale_factor"]
    for u, known in ((NAN, False), (1e-4, True)):
        given = fixed({"z": {"scale_factor": one(4e-3, u)}}, 25.0)
        fitted = fit(recording, None, effects, fixed=given).fitted
        found = rate_uncertainty(fitted, 50.0, 25.0, evidence=evidence_of(recording, None, effects, given), name="v")
        line = next(line for line in found["z"].budget.lines if line.source == "coefficients")
        assert (line.contribution is not None) is known
        assert ("held coefficients come without uncertainties (scale_factor)" in line.why) is not known
        if known:
            assert line.contribution == pytest.approx(50e-4, rel=0.2)
            assert line.freedom == 18


def test_a_table_is_held_at_its_own_temperatures_and_interpolated_to_those_measured() -> None:
    rng = np.random.default_rng(6)
    nodes, rates = np.array([-20.0, 10.0, 40.0]), np.array([-100.0, -30.0, 0.0, 50.0, 100.0])
    warm, rate = np.repeat(nodes + np.array([0.2, -0.1, 0.1]), 5), np.tile(rates, 3)
    output = rate * (1.003 + 1e-5 * warm) + 0.1 + 2e-3 * warm + rng.normal(0, 1e-4, 15)
    table = HeldCoefficient(tuple(3e-3 + 1e-5 * nodes), (1e-6,) * 3, "1", "", tuple(nodes))
    result = fit(points(rate, warm, output), "weiss1995", fixed=fixed({"z": {"scale_factor": table}}))
    axis = result.fitted.axes["z"]
    measured = nodes + np.array([0.2, -0.1, 0.1])
    np.testing.assert_allclose(axis.values[1], 3e-3 + 1e-5 * measured, atol=1e-9)
    np.testing.assert_allclose(axis.values[0], 0.1 + 2e-3 * measured, atol=3e-4)
    np.testing.assert_allclose(axis.u[1], 1e-6, rtol=0.05)
    constant = fit(points(rate, warm, output), "weiss1995", fixed=fixed({"z": {"scale_factor": one(3e-3, 1e-6)}}))
    assert constant.fitted.axes["z"].values[1] == pytest.approx([3e-3] * 3)
    cross = constant.fitted.axes["z"].covariance[3:, 3:]
    np.testing.assert_allclose(cross, np.full((3, 3), 1e-12))  # one value has one error at all temperatures
    with pytest.raises(
        BadInput, match=r"known.toml, axis z: scale_factor = .*: a table at -20, 10, 40 deg C, but here"
    ):
        fit(points(rate, warm + 5, output), "weiss1995", fixed=fixed({"z": {"scale_factor": table}}))


def test_several_recordings_are_fitted_beside_what_is_held() -> None:
    joined = joined_recording(recordings(3))
    held = {name: one(TRUTH[name], u) for name, u in (("scale_factor", 1e-6), ("scale_factor_t1", 1e-8))}
    effects = ["bias", "bias_temperature:2", "scale_factor", "scale_factor_temperature:1"]
    result = fit(joined, None, effects, fixed=fixed({"z": held}, CENTRE_C))
    axis = result.fitted.axes["z"]
    found = dict(zip(axis.names, axis.values[:, 0], strict=True))
    u = dict(zip(axis.names, axis.u[:, 0], strict=True))
    assert found["scale_factor"] == TRUTH["scale_factor"]
    for name in ("bias", "bias_t1", "bias_t2"):
        assert abs(found[name] - TRUTH[name]) < 3 * u[name]
    assert result.joint is not None
    assert {each["effect"] for each in result.joint["agreement"]} == {"bias", "bias_temperature"}


REFUSED = {
    "scale": (
        {"bais": one(0.1, unit="deg/s")},
        "axis z: bais = 0.1 deg/s: model custom has no such coefficient; choose",
    ),
    "unit": (
        {"bias": one(0.1, unit="rad/s")},
        "bias = 0.1 rad/s: the unit of this coefficient is 'deg/s', not 'rad/s'",
    ),
    "law": ({"k_squared": one(0.2)}, "k_squared = 0.2: the shape of effect sine_response is fitted"),
    "all": ({"bias": one(0.1), "scale_factor": one(0.0), "k_squared": one(0.0)}, "cannot be held; leave"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_held_is_refused(case: str) -> None:
    given, text = REFUSED[case]
    with pytest.raises(BadInput, match=r"^known\.toml, ") as refused:
        fit(grid(7), None, ["bias", "scale_factor", "sine_response"], fixed=fixed({"z": given}))
    assert text in str(refused.value)


def test_other_refusals_name_the_file_and_say_what_to_do() -> None:
    recording, bias = grid(8), {"z": {"bias": one(0.1)}}
    with pytest.raises(BadInput, match=r"known.toml, axis x: the recording has only z; leave axis x out"):
        fit(recording, "bias", fixed=fixed({"x": {"bias": one(0.1)}}))
    with pytest.raises(BadInput, match=r"known.toml, axis z: all coefficients of model bias are held \(bias\)"):
        fit(recording, "bias", fixed=fixed(bias))
    with pytest.raises(BadInput, match=r"known.toml: effect bias_temperature is centred .*reference_temperature_c ="):
        fit(recording, "bias_temperature", fixed=fixed(bias))
    with pytest.raises(BadInput, match=r"known.toml: its coefficients belong to a law of the output, but model bias"):
        fit(recording, "bias", fixed=replace(fixed(bias), argument="output"))
    with pytest.raises(BadInput, match=r"known.toml: has no coefficient of the effects of model bias"):
        fit(recording, "bias", fixed=replace(fixed({"z": {"asymmetry": one(0.1)}}), only_of_model=True))


def test_beside_published_coefficients_nothing_is_held() -> None:
    recording = grid(10)
    info = recording.info.model_copy(update={"kind": "coefficients"})
    with pytest.raises(BadInput, match=r"known.toml: the recording of ONE is a table of coefficients, beside which"):
        fit(Recording(info, recording.columns), "bias", fixed=fixed({"z": {"bias": one(0.1)}}))


def test_a_reference_temperature_is_the_one_that_the_values_hold_for() -> None:
    held = {"bias": one(0.2 - 3e-3 * 25), "scale_factor": one(4e-3)}
    result = fit(grid(9, 1e-9), None, ["bias", "bias_temperature:1", "scale_factor"], fixed=fixed({"z": held}, 0.0))
    assert result.fitted.model.reference == Reference(0.0)
    assert result.fitted.axes["z"].values[1, 0] == pytest.approx(3e-3, abs=1e-8)
    assert result.error.heldout_rms_dps is not None
    assert result.error.heldout_rms_dps < 1e-6
