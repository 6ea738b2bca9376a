"""Held-out errors: each temperature, or each turn by hand, corrected by a fit without its data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.errors import NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.inversion import NotConverged
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.least_squares import Solution


def held_out_errors(data: FitData, preset: Preset, solutions: Mapping[str, Solution]) -> dict[str, Array]:
    """Return axis -> (m,) deg/s, corrected minus true rate of each part left out in turn (`held_out_pairs`).

    The drift of each axis stays that of `solutions`, the fit to all data sets. Empty where a fold leaves too little.
    """
    pairs = data.held_out_pairs
    if preset.inner_only:
        pairs = pairs[1:-1]
    errors: dict[str, list[Array]] = {axis: [] for axis in data.outputs}
    for seen, left_out in pairs:
        if len(seen) == 0:
            return {}
        try:
            model, rows = preset.build(seen)
            require_enough_data(seen.take(rows), model)
            found = solve_axes(seen.take(rows), model, solutions)
        except NotEnoughData:
            return {}
        try:
            left = residuals(FittedModel(model, found.fits), left_out, found.nuisance)
        except NotConverged as error:
            at_c = float(left_out.temperature_c.mean())
            raise NotConverged(
                f"{error}; this fit left out the data sets near {at_c:.1f} deg C, to test the "
                "model at a temperature that it was not fitted to"
            ) from None
        for axis, values in left.items():
            errors[axis].append(values)
    return {axis: np.concatenate(parts) for axis, parts in errors.items() if parts}
