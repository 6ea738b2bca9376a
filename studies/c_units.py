"""Calibrations of every starting model, and of every effect, that the C code carries: made from plain formulas."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial

import numpy as np

from labctl.answers.fitted_model import Coefficient
from labctl.calibration import Calibration, build_calibration, hash_of
from labctl.fitting import fit
from labctl.fitting.models.force_sensitivity import ForceSensitivity
from labctl.recording import Recording, RecordingInfo
from studies import hand_turns
from studies.poses_simulation import Session, simulate_session
from studies.rest_units import Hidden, unit_at_rest

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
SEED = 5
LEVELS_C = np.arange(-40.0, 51.0, 10.0)
RATES_DPS = np.array([0.0, *(s * r for r in (1, 10, 50, 100, 200, 300, 400) for s in (1, -1))])
#: g-sensitivity of a MEMS gyro, deg/s/g and deg/s/g^2, standard deviations.
PER_G, PER_G2 = 0.02, 0.002
#: Constants of the sine responses of three axes, rad/(rad/s).
SINES = (0.02, 0.05, 0.1)


def calibrated(recording: Recording, model: str | None = None, effects: list[str] | None = None) -> Calibration:
    """Return the calibration of a recording."""
    result = fit(recording, model, effects or [])
    return build_calibration(recording.info, result, version=1, parent=None, issued_at=AT, provenance={"recording": 1})


def on_table(axes: str = "xyz", *, bends: bool = False) -> Recording:
    """Return means of data sets at all levels and rates, about each axis; with a sine response where it `bends`."""
    rng = np.random.default_rng(SEED)
    position, warm, rate = (
        grid.ravel() for grid in np.meshgrid(np.array(list(axes)), LEVELS_C, RATES_DPS, indexing="ij")
    )
    true = np.stack([np.where(position == axis, rate, 0.0) for axis in axes], axis=1)
    seen = true.copy()
    if bends:
        seen = np.rad2deg(np.sin(np.deg2rad(true) * SINES[: len(axes)]) / SINES[: len(axes)])
    gain = np.eye(len(axes)) + rng.normal(0, 0.01, (len(axes), len(axes)))
    drift, bow, slope = rng.normal(0, 0.2, len(axes)), rng.normal(0, 0.05, len(axes)), rng.normal(0, 2e-3, len(axes))
    u = (warm[:, None] - 5.0) / 45.0
    output = seen - true + true @ gain.T + 0.3 + drift * u + bow * u**2 + slope * u * true - 3e-9 * true**3
    output += rng.normal(0, 1e-3, output.shape)
    n = len(rate)
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": 75.0 * np.arange(n), "run": np.ones(n, dtype=np.int64),
        "position": position, "table_rate_dps": rate, "temperature_c": warm,
        **{f"gyro_{axis}": output[:, i] for i, axis in enumerate(axes)},
    }  # fmt: skip
    info = {"serial": "POINTS-1", "axes": tuple(axes), "kind": "points", "started_at": AT}
    return Recording(RecordingInfo.model_validate(info), columns)


def on_table_fit(model: str | None, effects: list[str] | None = None, axes: str = "xyz") -> Calibration:
    """Return a fit to a unit on a rate table; the unit has a sine response where the fit has one."""
    return calibrated(on_table(axes, bends="sine_response" in (effects or [])), model, effects)


def at_rest_fit(model: str | None, effects: list[str] | None = None, hidden: Hidden | None = None) -> Calibration:
    """Return a fit to a unit at rest through loops of temperature."""
    return calibrated(unit_at_rest(SEED, hidden or Hidden()), model, effects)


def by_hand_fit(model: str) -> Calibration:
    """Return a fit to a unit turned by hand: by known angles, or between poses."""
    if model == "poses":
        return calibrated(simulate_session(SEED, Session(latitude_deg=48.0, temperature_c=23.5))[0], model)
    rng = np.random.default_rng(SEED)
    return calibrated(hand_turns.measured(rng, hand_turns.Unit.drawn(rng), 1.0, 1, 360.0), model)


def sensitive(made: Callable[[], Calibration]) -> Calibration:
    """Return a calibration with g-sensitivities drawn for it."""
    calibration, rng = made(), np.random.default_rng(SEED)
    axes = calibration.axes
    known = ForceSensitivity(axes, rng.normal(0, PER_G, (len(axes), 3)), rng.normal(0, PER_G2, len(axes)))
    coefficients: dict[str, dict[str, Coefficient]] = {}
    for row, axis in enumerate(axes):
        named = {"g_own" if body == axis else f"g_{body}": v for body, v in zip("xyz", known.per_g[row], strict=True)}
        coefficients[axis] = {name: {"value": float(v), "u": None, "unit": "deg/s/g"} for name, v in named.items()}
        coefficients[axis]["g_own_squared"] = {"value": float(known.per_g2[row]), "u": None, "unit": "deg/s/g^2"}
    sizes = dict(zip(axes, known.at_1_g_dps.tolist(), strict=True))
    document = calibration.document.copy()
    document["specific_force"] = {
        "input": "specific_force_g", "coefficients": coefficients, "at_1_g_dps": sizes, "not_measured": {},
    }  # fmt: skip
    document["hash"] = hash_of(document)
    return Calibration(document)


OJEDA, YANG = partial(on_table_fit, "ojeda2000", axes="z"), partial(on_table_fit, "yang2018")
BENT = partial(on_table_fit, "yang2018", ["sine_response"])
LAG = partial(at_rest_fit, None, ["bias", "bias_temperature", "thermal_lag"], Hidden(lag_s=400.0))
LOOP = partial(at_rest_fit, None, ["bias", "bias_temperature", "thermal_hysteresis"], Hidden(width_k=4.0))

#: What is computed -> the calibration that computes it.
UNITS: dict[str, Callable[[], Calibration]] = {
    "`ojeda2000`": OJEDA,
    "`ojeda2000`, g-sensitivity": partial(sensitive, OJEDA),
    "`yang2018`": YANG,
    "`yang2018`, g-sensitivity": partial(sensitive, YANG),
    "`single_temperature`": partial(on_table_fit, "single_temperature"),
    "`weiss1995`": partial(on_table_fit, "weiss1995", axes="z"),
    "`bias_scale`": partial(on_table_fit, "bias_scale"),
    "bias, scale factor, non-orthogonality": partial(on_table_fit, None, ["bias", "scale_factor", "non_orthogonality"]),
    "`bias_temperature`": partial(at_rest_fit, "bias_temperature"),
    "`bias`": partial(at_rest_fit, "bias"),
    "`turns`, g-sensitivity": partial(by_hand_fit, "turns"),
    "`poses`, g-sensitivity": partial(by_hand_fit, "poses"),
    "`bias_scale`, sine response": partial(on_table_fit, "bias_scale", ["sine_response"], axes="z"),
    "`yang2018`, sine response": BENT,
    "`yang2018`, sine response, g-sensitivity": partial(sensitive, BENT),
    "bias over temperature, thermal lag": LAG,
    "bias over temperature, thermal hysteresis": LOOP,
    "bias over temperature, thermal lag, g-sensitivity": partial(sensitive, LAG),
}
