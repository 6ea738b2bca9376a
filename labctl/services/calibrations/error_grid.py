"""The errors of calibrations on one grid of rate vectors and temperatures, so that versions and units are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labctl.calibration import Calibration
from labctl.errors import LabctlError
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.models.true_rate_error import errors_at_true_rates
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.vector_bound import PLACES
from labctl.services.calibrations.uncertainty import places_of

#: How far beyond its limits a version still counts as valid at a place.
MARGIN_SHARE, MARGIN_C = 1e-3, 1.0
#: Rotations at which errors are compared: about any axis, or about that of each output alone.
About = Literal["any axis", "own axis"]


@dataclass(frozen=True)
class ErrorGrid:
    """Places over the validity of one calibration: temperature, rate vector and output."""

    axes: tuple[str, ...]  #: outputs
    temperature_c: Array  #: (n,)
    rates_dps: Mapping[str, Array]  #: (n,) about each body axis
    counts: Mapping[str, NDArray[np.bool_]]  #: output -> where its error counts, (n,)

    @staticmethod
    def of(calibration: Calibration, about: About) -> ErrorGrid:
        """Return the grid of a calibration. Raises BadInput, NotEnoughData."""
        vectors, (_, temperatures) = _vectors(calibration, about), places_of(calibration)
        rates = {
            axis: np.tile([at.get(axis, 0.0) for at, _ in vectors], len(temperatures)).astype(np.float64)
            for axis in BODY_AXES
        }
        counts = {
            axis: np.tile([axis in outputs for _, outputs in vectors], len(temperatures)) for axis in calibration.axes
        }
        temperature_c = np.repeat(np.asarray(temperatures, dtype=np.float64), len(vectors))
        return ErrorGrid(calibration.axes, temperature_c, rates, counts)

    def errors_dps(self, calibration: Calibration) -> Array | None:
        """Return the modelled errors of a calibration, (places,) deg/s, NaN where it is not valid.

        None where it has other outputs, or its model needs channels that a grid does not have.
        """
        if calibration.axes != self.axes or calibration.fitted.model.needs:
            return None
        n = len(self.temperature_c)
        columns = {
            "temperature_c": self.temperature_c, "table_rate_dps": np.zeros(n), "position": np.full(n, "z"),
        }  # fmt: skip
        try:
            errors = errors_at_true_rates(calibration.fitted, Channels(columns, dict(self.rates_dps)))
        except LabctlError:  # a law that has no inverse there
            return None
        valid = self._is_valid(calibration)
        return np.concatenate([np.where(valid, errors[axis], np.nan)[self.counts[axis]] for axis in self.axes])

    def _is_valid(self, calibration: Calibration) -> NDArray[np.bool_]:
        """Return where a version is valid, (n,); a limit that it does not have is none."""
        (slow, fast), (coldest, hot) = calibration.rate_dps, calibration.temperature_c
        valid = np.ones(len(self.temperature_c), dtype=np.bool_)
        if np.isfinite(fast - slow):
            size = np.linalg.norm(np.stack(list(self.rates_dps.values())), axis=0)
            valid &= size <= max(abs(slow), abs(fast)) * (1 + MARGIN_SHARE)
        if np.isfinite(hot - coldest):
            valid &= (self.temperature_c >= coldest - MARGIN_C) & (self.temperature_c <= hot + MARGIN_C)
        return valid


def _vectors(calibration: Calibration, about: About) -> list[tuple[Mapping[str, float], Sequence[str]]]:
    """Return the rate vectors at which errors are compared, and the outputs that count at each."""
    rates, _ = places_of(calibration)
    if about == "own axis":
        return [({axis: rate}, (axis,)) for axis in calibration.axes for rate in rates]
    reach, axes = max(map(abs, rates)), calibration.axes
    return [({axis: reach * part for axis, part in zip(BODY_AXES, place, strict=True)}, axes) for place in PLACES]
