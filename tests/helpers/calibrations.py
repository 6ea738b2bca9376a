"""Calibrations of made-up recordings, and readings within their range."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from labctl.answers.fitted_model import Coefficient
from labctl.calibration import Calibration, build_calibration, hash_of
from labctl.fitting import fit
from labctl.fitting.models.force_sensitivity import ForceSensitivity
from labctl.recording import Recording

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


def calibrated(recording: Recording, model: str | None = None, effects: list[str] | None = None) -> Calibration:
    result = fit(recording, model, effects)
    return build_calibration(recording.info, result, version=1, parent=None, issued_at=AT, provenance={"recording": 1})


def inside(calibration: Calibration, n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    return rng.uniform(slow, fast, (n, len(calibration.axes))) * 0.9, rng.uniform(low, high, n)


def with_force(calibration: Calibration, per_g: np.ndarray, per_g2: np.ndarray) -> Calibration:
    """Return a calibration with g-sensitivity, (axes, 3) deg/s/g and (axes,) deg/s/g^2; NaN: not measured."""
    known = ForceSensitivity(calibration.axes, per_g, per_g2)
    coefficients: dict[str, dict[str, Coefficient]] = {axis: {} for axis in calibration.axes}
    for row, axis in enumerate(calibration.axes):
        named = {"g_own" if body == axis else f"g_{body}": v for body, v in zip("xyz", per_g[row], strict=True)}
        for name, value in {**named, "g_own_squared": per_g2[row]}.items():
            if not np.isnan(value):
                unit = "deg/s/g^2" if name.endswith("squared") else "deg/s/g"
                coefficients[axis][name] = {"value": float(value), "u": 1e-4, "unit": unit}
    document = {
        **calibration.document,
        "specific_force": {
            "input": "specific_force_g", "coefficients": coefficients, "not_measured": known.not_measured,
            "at_1_g_dps": dict(zip(known.axes, known.at_1_g_dps.tolist(), strict=True)),
        },
    }  # fmt: skip
    document["hash"] = hash_of(document)
    return Calibration(document)
