"""A compensator that remembers, and one with a specific force: step by step against a lag that is written out here."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from labctl import compensator as module
from labctl.calibration import Calibration
from labctl.compensator import Compensator, LeftOutWarning, MemoryState
from labctl.errors import BadInput
from labctl.fitting import fit_data_of
from tests.helpers.calibrations import with_force
from tests.helpers.small_calibrations import one_axis, small, two_axes

LAWS = ["lag", "lags", "direct, lag", "direct, lags", "two axes, lags"]
PER_G, PER_G2 = np.array([[0.3, -0.2, 0.1]]), np.array([0.05])
T_S = np.array([0.0, 10.0, 30.0, 31.0, 200.0, 200.0, 260.0])
WARM_C = np.array([25.0, 26.0, 30.0, 30.5, 38.0, 38.0, 33.0])


def raws(calibration: Calibration, n: int = 7) -> np.ndarray:
    return np.random.default_rng(2).uniform(-90.0, 90.0, (n, len(calibration.axes)))


def behind_k(tau_s: float, t_s: np.ndarray, warm_c: np.ndarray) -> np.ndarray:
    """Return how far an element of one time constant is behind a temperature that is straight between its samples."""
    behind = [0.0]
    for dt, rise in zip(np.diff(t_s).tolist(), np.diff(warm_c).tolist(), strict=True):
        decay = np.exp(-dt / tau_s)
        behind.append(behind[-1] * decay - (rise * tau_s / dt * (1 - decay) if dt else rise))
    return np.array(behind)


def errors(calibration: Calibration, t_s: np.ndarray, warm_c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors of bias, deg/s, and scale factor by the state elements of the file, (n, axes) each."""
    bias = scale = np.zeros((len(t_s), len(calibration.axes)))
    for element in calibration.document["state"]["elements"]:
        assert element["kind"] == "lag"
        late = behind_k(element["tau_s"], t_s, warm_c)[:, None]
        bias = bias + late * np.array(element["size"])
        scale = scale + late * np.array(element.get("scale", 0.0))
    return bias, scale


def rest(calibration: Calibration, raw: np.ndarray, warm_c: np.ndarray) -> np.ndarray:
    """Return the rates where each sample is the first one: nothing lags yet."""
    return np.array([Compensator(calibration).step(row, c, 0.0)[0] for row, c in zip(raw, warm_c, strict=True)])


@pytest.mark.parametrize("beyond", [1.0, 2.0])
@pytest.mark.parametrize("name", LAWS)
def test_a_lag_is_taken_off_the_output_or_solved_with_the_rate(name: str, beyond: float) -> None:
    """With outputs beyond the calibrated rates too, where a scale factor that lags counts as at the edge."""
    calibration = small(name)
    raw = beyond * raws(calibration)
    bias, scale = errors(calibration, T_S, WARM_C)
    assert np.abs(bias).max() > 1e-3
    found = Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S})
    if "direct" in name:
        expected = rest(calibration, raw, WARM_C) - bias - scale * np.clip(raw, -104.0, 104.0)
    else:
        rate = np.clip(found.rate_dps, -104.0, 104.0)
        expected = rest(calibration, raw - bias - scale * rate, WARM_C)
    assert found.rate_dps == pytest.approx(expected, abs=1e-9)
    in_order = "direct" in name or beyond == 1.0
    assert not in_order or found.outside.tolist() == (np.abs(raw) > 104.0).any(axis=1).tolist()


@pytest.mark.parametrize("name", LAWS)
def test_samples_blocks_and_an_array_are_corrected_alike(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calibration = small(name)
    raw = raws(calibration)
    whole = Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S}).rate_dps
    running, continued = Compensator(calibration), Compensator(calibration)
    stepped = [running.step(raw[k], WARM_C[k], T_S[k])[0] for k in range(7)]
    assert np.array(stepped) == pytest.approx(whole, abs=1e-12)
    parts = [continued.compensate(raw[b], WARM_C[b], {"t_s": T_S[b]}, continued=True).rate_dps
             for b in (slice(0, 1), slice(1, 5), slice(5, 7))]  # fmt: skip
    assert np.concatenate(parts) == pytest.approx(whole, abs=1e-12)
    again = continued.compensate(raw, WARM_C, {"t_s": T_S})  # a course of its own
    assert again.rate_dps == pytest.approx(whole, abs=1e-12)
    monkeypatch.setattr(module, "BLOCK", 3)
    assert Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S}).rate_dps == pytest.approx(whole, abs=1e-12)


def test_whether_a_calibration_remembers_and_what() -> None:
    plain, lags = Compensator(small("plain")), Compensator(small("lags"))
    assert (plain.remembers, plain.state, lags.remembers, lags.state) == (False, None, True, None)
    with pytest.raises(BadInput, match="ONE: its calibration has no lag and no hysteresis"):
        plain.start(MemoryState(0.0, 20.0, ()))
    plain.reset()
    lags.step(1.0, 25.0, 0.0)
    lags.step(1.0, 35.0, 100.0)
    assert lags.state is not None
    assert (lags.state.t_s, lags.state.temperature_c) == (100.0, 35.0)
    follows = [35.0 + behind_k(tau_s, np.array([0.0, 100.0]), np.array([25.0, 35.0]))[1] for tau_s in (250.0, 400.0)]
    assert lags.state.at_c == pytest.approx(follows)
    warm = Compensator(small("lags"))
    warm.start(lags.state)
    assert warm.step(50.0, 30.0, 150.0)[0] == pytest.approx(lags.step(50.0, 30.0, 150.0)[0], abs=1e-12)
    lags.reset()
    assert lags.state is None
    assert lags.step(50.0, 30.0, 0.0)[0] == pytest.approx(rest(small("lags"), np.array([[50.0]]), np.array([30.0]))[0])


def test_samples_come_in_order_of_time_with_time_and_temperature() -> None:
    lags = Compensator(small("lags"))
    for warm_c, t_s in ((30.0, None), (None, 0.0)):
        with pytest.raises(BadInput, match="ONE: its model depends on earlier temperatures; give t_s and temperature"):
            lags.step(1.0, warm_c, t_s)
    lags.step(1.0, 30.0, 10.0)
    lags.step(1.0, 30.0, 10.0)  # two at one time
    with pytest.raises(BadInput, match=r"t_s = 9\.5 s is before the last sample's 10 s"):
        lags.step(1.0, 30.0, 9.5)
    with pytest.raises(BadInput, match=r"sample 1: t_s = 9 s is before 10 s"):
        lags.compensate([1.0], 30.0, {"t_s": np.array([9.0])}, continued=True)
    with pytest.raises(BadInput, match=r"sample 3: t_s = 1 s is before 2 s"):
        lags.compensate([1.0] * 3, 30.0, {"t_s": np.array([0.0, 2.0, 1.0])})


def test_a_refusal_names_the_sample_of_the_whole_array(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BLOCK", 3)
    for name in ("lags", "direct, lags"):
        refuse = Compensator(small(name), "refuse")
        raw = np.array([0.0] * 5 + [500.0, 0.0])
        with pytest.raises(BadInput, match=r"^sample 6: rate \["):
            refuse.compensate(raw, WARM_C, {"t_s": T_S})
        found = Compensator(small(name)).compensate(raw, WARM_C, {"t_s": T_S})
        assert found.outside.tolist() == [False] * 5 + [True, False]
        assert Compensator(small(name)).step(500.0, 30.0, 0.0)[1] is True


def test_a_channel_beside_the_time_is_that_of_its_sample_or_one_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    calibration, supply = small("supply, lag"), 5.0 + 0.1 * np.cos(T_S)
    raw = raws(calibration)
    whole = Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S, "supply_v": supply}).rate_dps
    each = [
        Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S, "supply_v": np.full(7, volts)}).rate_dps[k]
        for k, volts in enumerate(supply)
    ]
    assert whole == pytest.approx(np.array(each), abs=1e-12)
    assert np.ptp(whole - each[0]) > 1e-3
    monkeypatch.setattr(module, "BLOCK", 3)
    blocks = Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S, "supply_v": supply}).rate_dps
    assert blocks == pytest.approx(whole, abs=1e-12)
    one: Any = supply[0]
    found = Compensator(calibration).compensate(raw, WARM_C, {"t_s": T_S, "supply_v": one}).rate_dps
    assert found[0] == pytest.approx(whole[0], abs=1e-12)
    for warm in (30.0, np.array([30.0])):
        still = Compensator(calibration).compensate(raw, warm, {"t_s": T_S, "supply_v": one}).rate_dps
        assert still[6] == pytest.approx(Compensator(calibration).compensate(
            raw[6:], 30.0, {"t_s": T_S[6:], "supply_v": one}
        ).rate_dps[0], abs=1e-12)  # fmt: skip


def test_one_temperature_or_that_of_each_axis_is_followed_by_its_mean() -> None:
    calibration = small("two axes, lags")
    raw, columns = raws(calibration), {"t_s": T_S}
    still = Compensator(calibration).compensate(raw, 30.0, columns).rate_dps
    assert still == pytest.approx(rest(calibration, raw, np.full(7, 30.0)), abs=1e-9)
    of_axes = np.column_stack([WARM_C - 1.0, WARM_C + 1.0])
    found = Compensator(calibration).compensate(raw, of_axes, columns).rate_dps
    bias, scale = errors(calibration, T_S, WARM_C)
    first = [
        Compensator(calibration).compensate(row[None, :], warm[None, :], {"t_s": np.zeros(1)}).rate_dps[0]
        for row, warm in zip(raw - bias - scale * found, of_axes, strict=True)
    ]
    assert found == pytest.approx(np.array(first), abs=1e-9)


def test_with_the_history_of_its_recording_a_lag_is_that_of_the_fit() -> None:
    """The history knows the temperatures between the samples too; without it they go straight from one to the next."""
    some = slice(2, None, 7)
    for name in LAWS:
        calibration = small(name)
        data = fit_data_of(one_axis() if len(calibration.axes) == 1 else two_axes())
        raw = np.column_stack([data.outputs[axis] for axis in calibration.axes])[some]
        columns = {name: values[some] for name, values in data.channels.columns.items()}
        warm, known = columns["temperature_c"], {"t_s": columns["t_s"], "run": columns["run"]}
        expected = calibration.fitted.compensate(data.outputs, data.channels, {})
        compensator = Compensator(calibration)
        found = compensator.compensate(raw, warm, known, history=data.channels.history)
        assert found.rate_dps == pytest.approx(np.column_stack([expected[a] for a in calibration.axes])[some], abs=1e-6)
        by_axis = np.column_stack([warm] * len(calibration.axes))
        again = compensator.compensate(raw, by_axis, known, history=data.channels.history)
        assert again.rate_dps == pytest.approx(found.rate_dps, abs=1e-9)
        without = compensator.compensate(raw, warm, {"t_s": columns["t_s"]}).rate_dps
        assert np.abs(without - found.rate_dps).max() > 1e-4
        assert compensator.state is None
    plain, data = Compensator(small("plain")), fit_data_of(one_axis())
    found = plain.compensate(data.outputs["z"], 30.0, history=data.channels.history)
    assert found.rate_dps.tolist() == plain.compensate(data.outputs["z"], 30.0).rate_dps.tolist()


@pytest.mark.parametrize("name", ["plain", "direct", "lags", "direct, lags"])
def test_what_a_specific_force_adds_is_taken_off_first(name: str) -> None:
    calibration = small(name)
    compensator, raw = Compensator(with_force(calibration, PER_G, PER_G2)), raws(calibration)
    force = np.random.default_rng(3).normal(size=(7, 3))
    added = force @ PER_G.T + PER_G2 * force[:, 2:] ** 2
    found = compensator.compensate(raw, WARM_C, {"t_s": T_S}, specific_force_g=force)
    without = Compensator(calibration)
    if "direct" in name:
        expected = without.compensate(raw, WARM_C, {"t_s": T_S}).rate_dps - added
    else:
        expected = without.compensate(raw - added, WARM_C, {"t_s": T_S}).rate_dps
    assert found.rate_dps == pytest.approx(expected, abs=1e-9)
    assert found.left_out_dps is None
    stepped = [compensator.step(raw[k], WARM_C[k], T_S[k], specific_force_g=force[k])[0] for k in range(7)]
    assert np.array(stepped) == pytest.approx(expected, abs=1e-9)
    one = Compensator(with_force(calibration, PER_G, PER_G2)).compensate(
        raw, WARM_C, {"t_s": T_S}, specific_force_g=force[0]
    )
    assert one.rate_dps[0] == pytest.approx(expected[0], abs=1e-9)


def test_a_step_has_one_specific_force() -> None:
    for name in ("plain", "lags"):
        compensator = Compensator(with_force(small(name), PER_G, PER_G2))
        with pytest.raises(BadInput, match=r"specific_force_g of shape \(2, 3\) given"):
            compensator.step(1.0, 30.0, 0.0, specific_force_g=np.ones((2, 3)))


def test_with_a_history_a_force_is_taken_off_as_well() -> None:
    data, calibration = fit_data_of(one_axis()), small("direct, lags")
    raw, columns = data.outputs["z"], {name: data.channels.columns[name] for name in ("t_s", "run")}
    warm, history = data.channels.columns["temperature_c"], data.channels.history
    force = [0.0, 0.0, 1.0]
    found = Compensator(with_force(calibration, PER_G, PER_G2)).compensate(
        raw, warm, columns, history=history, specific_force_g=force
    )
    plain = Compensator(calibration).compensate(raw, warm, columns, history=history)
    assert found.rate_dps == pytest.approx(plain.rate_dps - 0.15, abs=1e-12)


def test_without_the_force_the_answer_says_what_was_left_out_and_steps_warn_once() -> None:
    compensator = Compensator(with_force(small("plain"), PER_G, PER_G2))
    raw, at_1_g = np.array([10.0]), np.linalg.norm(PER_G) + PER_G2[0]
    assert compensator.compensate(raw, 30.0).left_out_dps == pytest.approx([at_1_g])
    assert compensator.force_sensitivity is not None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compensator.step(raw, 30.0, specific_force_g=[0.0, 0.0, 1.0])
    with pytest.warns(LeftOutWarning, match=r"^ONE: g-sensitivity is not corrected without specific_force_g"):
        compensator.step(raw, 30.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert compensator.step(raw, 30.0)[0] == pytest.approx(Compensator(small("plain")).step(raw, 30.0)[0])
        ignored = Compensator(small("plain")).compensate(raw, 30.0, specific_force_g=[0.0, 0.0, 1.0])
        Compensator(small("plain")).step(raw, 30.0)
    assert ignored.rate_dps.tolist() == Compensator(small("plain")).compensate(raw, 30.0).rate_dps.tolist()


@pytest.mark.parametrize("name", ["two axes", "two axes, lags"])
def test_a_rate_about_an_axis_without_output_is_taken_off(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also in one piece: each sample has its own rate, wherever a block would end."""
    monkeypatch.setattr(module, "BLOCK", 3)
    calibration = small(name)
    raw, known = np.zeros((7, 2)), {"t_s": T_S}
    found = (
        Compensator(calibration)
        .compensate(raw, 30.0, known, cross_rates_dps={"y": np.array([0.0, 50.0, -50.0, 0.0, 0.0, 10.0, 50.0])})
        .rate_dps
    )
    at_rest = Compensator(calibration).compensate(raw, 30.0, known).rate_dps
    assert found[[0, 3, 4]] == pytest.approx(at_rest[[0, 3, 4]], abs=1e-9)
    assert found[1] - at_rest[1] == pytest.approx([-0.03 * 50.0, 0.01 * 50.0], abs=0.1)
    assert found[2] + found[1] == pytest.approx(2 * at_rest[0], abs=1e-9)
    assert found[6] == pytest.approx(found[1], abs=1e-9)
    one = Compensator(calibration).compensate(raw, 30.0, known, cross_rates_dps={"y": 50.0}).rate_dps
    assert one == pytest.approx(np.tile(found[1], (7, 1)), abs=1e-9)


@pytest.mark.parametrize(
    ("across", "said"),
    [
        ({"x": 1.0}, "axis 'x': ONE has outputs x, z; give rates about y only"),
        ({"y": np.zeros(3)}, r"axis 'y' has shape \(3,\); give one rate, or one for each of the 4 samples"),
    ],
)
def test_a_rate_about_another_axis_or_of_another_shape_is_refused(across: Any, said: str) -> None:
    compensator = Compensator(small("two axes"))
    with pytest.raises(BadInput, match=f"cross_rates_dps of {said}"):
        compensator.compensate(np.zeros((4, 2)), 30.0, cross_rates_dps=across)
    compensator.axes = ("x", "y", "z")
    with pytest.raises(BadInput, match="give rates about no axis only"):
        compensator.compensate(np.zeros((4, 3)), 30.0, cross_rates_dps={"y": 1.0})
