"""How far a corrected rate of a version may be off, at one rate and temperature."""

from __future__ import annotations

from dataclasses import asdict

from labctl.calibration import read_calibration
from labctl.services.schemas.calibrations import AxisUncertainty, UncertaintyResponse
from labctl.store import Store
from labctl.uncertainty import COVERAGE, is_inside, rate_uncertainty


def uncertainty_at(
    store: Store, serial: str, version: int, rate_dps: float, temperature_c: float
) -> UncertaintyResponse:
    """Return the uncertainty about each axis. Raises NotFound, BadInput."""
    document, _ = store.calibrations.document(serial, version)
    calibration = read_calibration(document)
    found = rate_uncertainty(calibration, rate_dps, temperature_c)
    return UncertaintyResponse(
        serial=serial,
        version=version,
        rate_dps=rate_dps,
        temperature_c=temperature_c,
        coverage_factor=COVERAGE,
        inside=is_inside(calibration, rate_dps, temperature_c),
        axes={axis: AxisUncertainty(**asdict(one)) for axis, one in found.items()},
    )
