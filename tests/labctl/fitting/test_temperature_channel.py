"""Units without a thermometer of their own, and long data sets through which the temperature moved."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.calibration import build_calibration, read_calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting import fit
from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.static_record import static_record
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.data.temperature.history import history_of
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording, RecordingInfo, to_points
from labctl.recording.points import with_pieces

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
LOOP_S = 4 * 3600


def at_rest(n: int, low_c: float, high_c: float, datasets: int = 1, seed: int = 1) -> Recording:
    """Return n readings at rest, one a second, while the temperature goes up and back again."""
    t_s = np.arange(float(n))
    warm = np.interp(t_s, [0, n / 2, n], [low_c, high_c, low_c])
    scatter = np.random.default_rng(seed).normal(0.0, 0.01, n)
    gyro = 0.02 + 0.003 * (warm - 25.0) + 1e-4 * (warm - 25.0) ** 2 + scatter
    columns = {
        "dataset": 1 + np.arange(n) * datasets // n, "t_s": t_s, "position": np.full(n, "z"),
        "run": np.ones(n, dtype=np.int64), "table_rate_dps": np.zeros(n), "temperature_c": warm, "gyro_z": gyro,
    }  # fmt: skip
    return Recording(RecordingInfo(serial="REST", axes=("z",), kind="samples", started_at=AT), columns)


def by_chamber(recording: Recording) -> Recording:
    """Return a recording as a unit without a thermometer makes it."""
    columns = {name: values for name, values in recording.columns.items() if name != "temperature_c"}
    return replace(recording, columns=columns | {"chamber_c": recording.columns["temperature_c"]})


# ---- no thermometer ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["ojeda2000", None])
def test_where_a_unit_has_no_thermometer_the_chambers_stands_in(
    make_points: Callable[..., Recording], grid_11_by_11: tuple[np.ndarray, np.ndarray], model: str | None
) -> None:
    rate, warm = grid_11_by_11
    effects = [] if model else ["bias", "scale_factor", "bias_temperature"]
    recording = make_points(rate, warm, rate * 1.01 + 0.1 + 0.002 * (warm - 35.0))
    result, expected = fit(by_chamber(recording), model, effects), fit(recording, model, effects)
    assert result.fitted.axes["z"].values == pytest.approx(expected.fitted.axes["z"].values)
    assert result.temperature_c == (25.0, 45.0)
    assert "chamber" in result.environment["temperature"]
    assert "temperature" not in expected.environment


@pytest.mark.slow
def test_criticism_and_the_static_record_go_by_the_chamber_too() -> None:
    recording = by_chamber(at_rest(LOOP_S, 5.0, 45.0, datasets=240))
    model, _ = preset_for(None, ["bias"]).build(fit_data_of(recording))
    assert criticise(recording, model).verdict.named == ("bias_temperature",)
    found, expected = static_record(recording), static_record(at_rest(LOOP_S, 5.0, 45.0, datasets=240))
    assert found is not None
    assert expected is not None
    assert found.to_json() == expected.to_json()


def test_the_history_goes_by_the_same_thermometer() -> None:
    recording = by_chamber(at_rest(600, 20.0, 30.0, datasets=10))
    t_s = np.arange(0.0, 600.0, 10.0)
    logged = {"t_s": t_s, "temperature_c": np.full(len(t_s), 99.0), "chamber_c": np.full(len(t_s), 21.0)}
    warm = history_of(with_temperature(replace(recording, environment=logged))).profiles[1].temperature_c
    assert set(warm.tolist()) == {21.0}
    alone = with_temperature(replace(recording, environment={name: logged[name] for name in ("t_s", "temperature_c")}))
    assert alone.environment is None


def test_without_either_temperature_one_line_says_so() -> None:
    recording = at_rest(600, 20.0, 30.0, datasets=10)
    bare = replace(recording, columns={n: v for n, v in recording.columns.items() if n != "temperature_c"})
    model, _ = preset_for(None, ["bias"]).build(fit_data_of(recording))
    for act in (lambda: fit(bare, None, ["bias"]), lambda: criticise(bare, model)):
        with pytest.raises(NotEnoughData, match="REST: columns 'temperature_c' and 'chamber_c' are both missing"):
            act()
    found = static_record(bare)  # an Allan deviation needs no temperature
    assert found is not None
    assert found.to_json()["temperature_c"] is None


# ---- long data sets ------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("as_read", [lambda recording: recording, by_chamber])
def test_a_temperature_loop_in_one_data_set_is_as_good_as_one_in_many(
    as_read: Callable[[Recording], Recording],
) -> None:
    one, many = as_read(at_rest(LOOP_S, 5.0, 45.0)), as_read(at_rest(LOOP_S, 5.0, 45.0, datasets=240))
    result, expected = (fit(recording, None, ["bias", "bias_temperature"]) for recording in (one, many))
    assert result.temperature_c == pytest.approx((5.0, 45.0), abs=0.3)
    fitted = result.fitted.axes["z"]
    assert fitted.values[:, 0] == pytest.approx([0.02, 0.003, 1e-4], abs=5e-4)
    assert fitted.values == pytest.approx(expected.fitted.axes["z"].values, abs=1e-5)
    model, _ = preset_for(None, ["bias"]).build(fit_data_of(one))
    assert criticise(one, model).verdict.named == ("bias_temperature",)


def test_fit_and_criticism_see_the_same_rows_under_the_data_sets_number() -> None:
    recording = at_rest(LOOP_S, 5.0, 45.0)
    points, data = to_points(recording), reduce_recording(recording)
    assert len(points) == len(data) == 240
    assert set(points.columns["dataset"].tolist()) == set(data.dataset.tolist()) == {1}
    assert points.columns["n"].sum() == LOOP_S
    assert points.columns["duration_s"] == pytest.approx(60.0)
    assert data.output["z"][0] == pytest.approx(points.columns["gyro_z"], abs=1e-12)


@pytest.mark.parametrize(
    ("n", "low_c", "high_c"), [(3600, 25.0, 25.5), (550, 5.0, 45.0)], ids=["one temperature", "short"]
)
def test_what_is_short_or_at_one_temperature_stays_one_point(n: int, low_c: float, high_c: float) -> None:
    recording = at_rest(n, low_c, high_c)
    noisy = recording.columns["temperature_c"] + np.random.default_rng(2).normal(0.0, 0.3, n)
    recording = replace(recording, columns={**recording.columns, "temperature_c": noisy})
    assert np.ptp(noisy) > 1.5
    assert len(to_points(recording)) == len(reduce_recording(recording)) == 1


def test_the_invalid_and_the_lost_do_not_move_a_piece() -> None:
    recording = at_rest(LOOP_S, 5.0, 45.0)
    kept = np.r_[0:3000, 3400:LOOP_S]
    valid = (np.arange(LOOP_S) % 7 != 0).astype(np.int64)
    columns = {name: values[kept] for name, values in {**recording.columns, "valid": valid}.items()}
    points = to_points(replace(recording, columns=columns))
    assert len(points) == 240 - 6
    assert np.diff(points.columns["t_s"]).min() > 25.0
    assert points.columns["n"].sum() == int(columns["valid"].sum())


def test_means_kept_without_their_readings_get_rows_of_the_pieces() -> None:
    long, short = at_rest(LOOP_S, 5.0, 45.0), at_rest(60, 25.0, 25.0)
    t_s, number = short.columns["t_s"] - 100.0, short.columns["dataset"] - 1
    first = {**short.columns, "t_s": t_s, "dataset": number}
    names = [name for name in long.columns if name != "position"]
    whole = {name: np.array([first[name].mean(), long.columns[name].mean()]) for name in names} | {
        "position": np.array(["z", "z"]), "dataset": np.array([0, 1]), "n": np.array([60, LOOP_S]),
        "duration_s": np.array([60.0, LOOP_S]), "chamber_setpoint_c": np.array([25.0, 30.0]),
        "gyro_z_std": np.array([0.01, 0.05]), "gyro_z_white_std": np.array([0.01, 0.01]),
    }  # fmt: skip
    asked: list[int] = []

    def pieces_of(dataset: int) -> Recording:
        asked.append(dataset)
        return to_points(long)

    points = with_pieces(Recording(long.info.model_copy(update={"kind": "points"}), whole), pieces_of)
    assert asked == [1]
    assert points.columns["dataset"].tolist() == [0] + [1] * 240
    assert points.columns["gyro_z"][1:] == pytest.approx(to_points(long).columns["gyro_z"])
    assert points.columns["chamber_setpoint_c"].tolist() == [25.0] + [30.0] * 240
    assert points.info.kind == "points"


# ---- no data to spare ----------------------------------------------------------------------------------------------


def test_as_many_coefficients_as_data_sets_have_no_uncertainty(make_points: Callable[..., Recording]) -> None:
    recording = make_points(np.array([-10.0, 10.0]), np.full(2, 25.0), np.array([-10.1, 10.2]))
    result = fit(recording, None, ["bias", "scale_factor"])
    said = result.to_json()
    assert [c["u"] for c in said["axes"]["z"]["coefficients"].values()] == [None, None]
    assert said["axes"]["z"]["coefficients"]["bias"]["value"] == pytest.approx(0.05)
    json.dumps(said, allow_nan=False)
    made = build_calibration(recording.info, result, version=1, parent=None, issued_at=AT, provenance={})
    back = read_calibration(made.to_bytes())
    assert np.isnan(back.fitted.axes["z"].u).all()
    assert Compensator(back).compensate(np.array([10.2]), 25.0).rate_dps == pytest.approx([10.0])
    with pytest.raises(BadInput, match="temperature"):
        Compensator(back, "refuse").compensate(np.array([10.2]), np.array([np.nan]))


def test_one_data_set_more_than_coefficients_has_an_uncertainty(make_points: Callable[..., Recording]) -> None:
    recording = make_points(np.array([-10.0, 0.0, 10.0]), np.full(3, 25.0), np.array([-10.1, 0.01, 10.2]))
    coefficients = fit(recording, None, ["bias", "scale_factor"]).to_json()["axes"]["z"]["coefficients"]
    assert all(c["u"] > 1e-6 for c in coefficients.values())
