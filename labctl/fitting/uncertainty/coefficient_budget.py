"""Budgets of the coefficients: bias, scale factor and misalignments of each axis at one temperature; its response."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from labctl.fitting.effects import response
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.uncertainty.budget import Budget, BudgetLine, budget_of
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.evaluated_lines import coefficient_line, model_line, repeatability_line, slope_line
from labctl.fitting.uncertainty.rate_vector import require_law_of_rate_and_temperature
from labctl.fitting.uncertainty.sensitivity import OwnCoefficient, coefficients_of
from labctl.fitting.uncertainty.standard_lines import Sensitivities, standard_lines
from labctl.fitting.uncertainty.time_lines import time_lines
from labctl.fitting.uncertainty.use import AxisEvidence


def coefficient_budgets(
    fitted: FittedModel,
    temperature_c: float,
    *,
    evidence: Mapping[str, AxisEvidence],
    name: str,
    bench: BenchConditions | None = None,
) -> dict[str, dict[str, Budget]]:
    """Return axis -> name -> budget of `bias` (deg/s), `scale_factor` and `misalignment_<axis>` (shares of the rate).

    Only what the model has is there. The bias holds for later days; a scale factor and a misalignment are taken to
    repeat. Raises what `rate_uncertainty` raises.
    """
    require_law_of_rate_and_temperature(fitted, name)
    return {axis: _of_axis(fitted, axis, temperature_c, evidence.get(axis), bench) for axis in fitted.axes}


def _of_axis(
    fitted: FittedModel, axis: str, temperature_c: float, evidence: AxisEvidence | None, bench: BenchConditions | None
) -> dict[str, Budget]:
    laws = {
        name: (unit, law)
        for name, (unit, law) in coefficients_of(axis).items()
        if np.any(law.gradient(fitted, temperature_c))
    }
    values = {name: law.value(fitted, temperature_c) for name, (_, law) in laws.items()}
    budgets = {}
    for name, (unit, law) in laws.items():
        lines: list[BudgetLine] = [coefficient_line(fitted, law, temperature_c, evidence, unit)]
        if name == "bias":
            lines += [model_line(fitted, axis, evidence, {}, temperature_c), repeatability_line(fitted, evidence)]
        else:
            across = None if name == "scale_factor" else name.removeprefix("misalignment_")
            lines.append(slope_line(fitted, evidence, temperature_c, across))
        sensitivities = _sensitivities(axis, name, values, law.temperature_slope(fitted, temperature_c), bench)
        sources = [*time_lines(fitted, [law], temperature_c, bench), *standard_lines(bench, sensitivities)]
        lines += [source.lines[0] for source in sources]
        budgets[name] = budget_of(name, unit, lines, values[name])
    return budgets


def response_budgets(
    fitted: FittedModel, *, evidence: Mapping[str, AxisEvidence], bench: BenchConditions | None = None
) -> dict[str, dict[str, Budget]]:
    """Return axis -> name -> budget of the delay and the time constant of a model, s; nothing for one without them.

    The time of the reference moves a delay in full. Empty where the coefficients have no uncertainty.
    """
    by_axis: dict[str, dict[str, Budget]] = {}
    for axis, fit in fitted.axes.items():
        for name in (name for name, owner in zip(fit.names, fit.effects, strict=True) if owner in response.IDS):
            coefficient, axis_evidence = OwnCoefficient(axis, name), evidence.get(axis)
            if not np.isfinite(fit.u_of(name)):
                continue
            at_c = fitted.model.reference.temperature_c  # it is the same at all temperatures
            lines = [coefficient_line(fitted, coefficient, at_c, axis_evidence, "s")]
            lines += [source.lines[0] for source in time_lines(fitted, [coefficient], at_c, bench)]
            by_axis.setdefault(axis, {})[name] = budget_of(name, "s", lines, fit.value_of(name))
    return by_axis


def _sensitivities(
    axis: str, name: str, values: Mapping[str, float], temperature: float, bench: BenchConditions | None
) -> Sensitivities:
    """Return how a coefficient follows errors of the bench.

    One error of the time base is the same at all rates, so it is in the scale factor in full; a tilt of a mounting is a
    misalignment, and in a scale factor by the misalignments of the unit and by its cosine. That of a tilted mounting is
    in both.
    """
    if name == "bias":
        return Sensitivities.of_one(temperature=temperature, level=1.0)
    gain = 1.0 + values.get("scale_factor", 0.0)
    about = axis if name == "scale_factor" else name.removeprefix("misalignment_")
    tilted = bench.element_gains(axis, about) if bench is not None and bench.has_tilted else None
    if name != "scale_factor":
        gains = tilted or (bench.angle_gains(about) if bench is not None else None)
        return Sensitivities.of_one(relative_rate=values[name], temperature=temperature, angle=gain, gains=gains)
    across = math.hypot(*(value for other, value in values.items() if other.startswith("misalignment")))
    fastest = bench.max_rate_dps if bench is not None else None
    return Sensitivities.of_one(
        relative_rate=gain, rate_dps=1.0 / fastest if fastest else 0.0, temperature=temperature,
        angle=across if tilted is None else gain, gains=tilted, angle_squared=gain / 2,
    )  # fmt: skip
