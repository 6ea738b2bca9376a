"""Held-out errors by leg: fitted while the unit warms up and tested while it cools, and the other way round.

The temperatures of a loop come twice. Leaving out a temperature leaves out both of its passages; leaving out a leg asks
what a law of temperature alone can never answer: whether the way back is like the way there.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.errors import LabctlError
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.temperature.legs import legs_of
from labctl.fitting.estimation.axis_design import TOLD_APART
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.estimation.error_metrics import rms
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.least_squares import Solution
from labctl.json_types.models import LegErrorJson

#: Data sets that a leg needs, and legs up to which each is left out in turn.
LEAST_SETS, MOST_LEGS = 4, 12
#: A leg is tested within the temperatures that the others were fitted at, and so far beyond, K.
BEYOND_K = 1.0


def errors_by_leg(data: FitData, preset: Preset, solutions: Mapping[str, Solution]) -> list[LegErrorJson]:
    """Return the error of legs by fits to others; none where the temperature goes one way only.

    The drift of each axis stays that of `solutions`, the fit to all data sets.
    """
    if not data.channels.history.thermometer or "t_s" not in data.channels:
        return []
    run = np.asarray(data.channels["run"], dtype=np.int64) if "run" in data.channels else np.ones(len(data), dtype=int)
    legs = legs_of(data.temperature_c, run)
    up, down = legs > 0, legs < 0
    if min(int(up.sum()), int(down.sum())) < LEAST_SETS:
        return []
    found = [
        _tested(data, preset, solutions, [(up, down)], ("heating", "cooling")),
        _tested(data, preset, solutions, [(down, up)], ("cooling", "heating")),
    ]
    numbers, counts = np.unique(legs[legs != 0], return_counts=True)
    if 2 < len(numbers) <= MOST_LEGS and counts.min() >= LEAST_SETS:
        pairs = [((legs != 0) & (legs != number), legs == number) for number in numbers]
        found.append(_tested(data, preset, solutions, pairs, ("all legs but one", "each leg in turn")))
    return found


def _tested(
    data: FitData, preset: Preset, solutions: Mapping[str, Solution],
    pairs: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]], names: tuple[str, str],
) -> LegErrorJson:  # fmt: skip
    """Return the error of each second part of the data sets by a fit to the first, pooled."""
    errors: dict[str, list[Array]] = {axis: [] for axis in data.outputs}
    tested = 0
    for fitted_to, left_out in pairs:
        seen = data.take(fitted_to)
        low, high = float(seen.temperature_c.min()) - BEYOND_K, float(seen.temperature_c.max()) + BEYOND_K
        rest = data.take(left_out & (data.temperature_c >= low) & (data.temperature_c <= high))
        if len(rest) == 0:
            return _answer(names, None, 0, f"no data set of the {names[1]} is at a temperature of the {names[0]}")
        lost = [a for a in BODY_AXES if seen.distinct_rates(a) < TOLD_APART <= data.distinct_rates(a)]
        if lost:
            return _answer(names, None, 0, f"the {names[0]} do not turn the unit about {' and '.join(lost)}")
        try:
            model, rows = preset.build(seen)
            used = seen.take(rows)
            require_enough_data(used, model)
            solved = solve_axes(used, model, solutions)
            left = residuals(FittedModel(model, solved.fits), rest, solved.nuisance)
        except LabctlError as error:
            return _answer(names, None, 0, f"the {names[0]} alone does not determine the model: {error}")
        tested += len(rest)
        for axis, values in left.items():
            errors[axis].append(values)
    return _answer(names, rms({axis: np.concatenate(parts) for axis, parts in errors.items()}), tested, "")


def _answer(names: tuple[str, str], rms_dps: float | None, datasets: int, why: str) -> LegErrorJson:
    return {"fitted": names[0], "tested": names[1], "rms_dps": rms_dps, "datasets": datasets, "why": why}
