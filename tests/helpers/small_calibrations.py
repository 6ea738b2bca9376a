"""Calibrations of a few data sets, made within some hundredths of a second each, for tests of what corrects by them.

Their law is what matters, not how well it fits: each has terms of a size that a test can see.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache

import numpy as np

from labctl.calibration import Calibration, build_calibration
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import Term
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import preset_for, unchanged
from labctl.recording import Recording
from tests.helpers.calibrations import AT
from tests.helpers.recordings import points

EFFECTS = ["bias", "bias_temperature", "scale_factor", "scale_factor_temperature"]
LAG, SCALE_LAG = Term("thermal_lag", None, {"tau_s": 250.0}), Term("scale_factor_lag", None, {"tau_s": 400.0})
#: Every calibration is valid for these temperatures, deg C, and rates, deg/s.
VALID_C, VALID_DPS = (20.0, 40.0), (-100.0, 100.0)


def small(name: str) -> Calibration:
    """Return one of CALIBRATIONS, for a test alone."""
    return Calibration(deepcopy(_fitted(name).document))


@cache
def _fitted(name: str) -> Calibration:
    return CALIBRATIONS[name]()


def one_axis() -> Recording:
    rate, warm = np.tile([-100.0, -50.0, 0.0, 50.0, 100.0], 11), np.repeat(np.linspace(*VALID_C, 11), 5)
    t_s, u = 60.0 * np.arange(55), warm - 30.0
    output = rate * (1.01 + 1e-3 * u) + 0.1 + 0.02 * u + 0.02 * np.sin(t_s / 500) + 1e-3 * rate * np.cos(t_s / 700)
    made = points(rate, warm, output)
    return replace(made, columns=dict(made.columns) | {"supply_v": 5.0 + 0.1 * np.cos(t_s)})


def two_axes() -> Recording:
    """Means of a unit with outputs about x and z, each of which sees a part of every rate."""
    rate, warm = np.tile([-100.0, -50.0, 0.0, 50.0, 100.0], 9), np.tile(np.repeat([20.0, 30.0, 40.0], 5), 3)
    one = points(rate, warm, np.zeros(45))
    columns = dict(one.columns)
    columns["position"], columns["run"] = np.repeat(["x", "y", "z"], 15), np.repeat([1, 2, 3], 15)
    u = warm - 30.0
    own = {axis: np.where(columns["position"] == axis, rate, 0.0) for axis in "xyz"}
    slow, scatter = np.sin(columns["t_s"] / 500), np.random.default_rng(1).normal(0.0, 1e-3, (2, 45))
    columns["gyro_x"] = 1.01 * own["x"] + 0.03 * own["y"] + 0.02 * own["z"] + 0.1 + 0.01 * u + 0.05 * slow + scatter[0]
    columns["gyro_z"] = (
        (0.99 + 1e-3 * slow) * own["z"] - 0.01 * own["y"] + 0.04 * own["x"] - 0.2 + 0.02 * u + scatter[1]
    )
    return Recording(one.info.model_copy(update={"axes": ("x", "z")}), columns)


def _issued(recording: Recording, *more: Term | str, model: ErrorModel | None = None) -> Calibration:
    data = fit_data_of(recording)
    if model is None:
        named = [each for each in more if isinstance(each, str)]
        base = preset_for(None, [*EFFECTS, *named]).build(data)[0]
        model = base.with_added(tuple(each for each in more if isinstance(each, Term)))
    result = fit_preset(data, unchanged(model))
    return build_calibration(recording.info, result, version=1, parent=None, issued_at=AT, provenance={"recording": 1})


def _of_output(*lags: Term) -> Calibration:
    return _issued(one_axis(), model=ErrorModel("direct", (Term("rate_temperature_surface", 3), *lags), "output"))


CALIBRATIONS: dict[str, Callable[[], Calibration]] = {
    "plain": lambda: _issued(one_axis()),
    "lag": lambda: _issued(one_axis(), LAG),
    "lags": lambda: _issued(one_axis(), LAG, SCALE_LAG),
    "direct": _of_output,
    "direct, lag": lambda: _of_output(LAG),
    "direct, lags": lambda: _of_output(LAG, SCALE_LAG),
    "supply": lambda: _issued(one_axis(), "supply_sensitivity"),
    "supply, lag": lambda: _issued(one_axis(), "supply_sensitivity", LAG),
    "two axes": lambda: _issued(two_axes(), "misalignment"),
    "two axes, lags": lambda: _issued(two_axes(), "misalignment", LAG, SCALE_LAG),
}
