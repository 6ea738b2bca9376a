"""Uncertainty of a corrected rate of a calibration version: at one place, and over what was calibrated."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from labctl.answers.certification import AnyAxisUncertainty
from labctl.answers.uncertainty import (
    AxisUncertainty,
    UncertaintyGrid,
    UncertaintyResponse,
    VectorUncertainty,
)
from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY
from labctl.fitting.numeric.json_numbers import none_for_nan
from labctl.fitting.uncertainty import (
    COVERAGE,
    AxisEvidence,
    BenchConditions,
    Budget,
    RateUncertainty,
    RateVectorUncertainty,
    coefficient_budgets,
    of_budget,
    rate_uncertainty,
    rate_vector_uncertainty,
)
from labctl.fitting.uncertainty.document import Covered
from labctl.fitting.uncertainty.largest_error import widening
from labctl.fitting.uncertainty.vector_bound import PLACES
from labctl.services.calibrations.contributions import contributions_over
from labctl.services.criticism.versions import version_of
from labctl.services.standards.where_stated import remedy_of_unstated, were_imported
from labctl.store import CalibrationRecord, Store


def uncertainty_at(
    store: Store, serial: str, version: int, rate_dps: Sequence[float], temperature_c: float, *, grid: bool = False
) -> UncertaintyResponse:
    """Return the uncertainty of each output, with `grid` also over the validity. Raises NotFound, BadInput.

    `rate_dps` is one rate, about one axis after the other, or a rate vector about x, y and z.
    """
    row = store.calibrations.get(serial, version)
    answer = uncertainty_answer(read_calibration(row.document), rate_dps, temperature_c, grid=grid)
    return _with_remedy(store, row, answer)


def uncertainty_of_unit(
    store: Store,
    serial: str,
    version: int | None,
    rate_dps: Sequence[float] | None,
    temperature_c: float | None,
    *,
    grid: bool,
) -> UncertaintyResponse:
    """Return the uncertainty of a version, or of the newest, at half of the fastest rate and the middle temperature.

    Raises NotFound, BadInput, NotEnoughData.
    """
    row = version_of(store, serial, version)
    calibration = read_calibration(row.document)
    covered = Covered(calibration.rate_dps, calibration.temperature_c)
    rates, temperatures_c = covered.rates(_Known.of(calibration).evidence), covered.temperatures()
    answer = uncertainty_answer(
        calibration,
        [max(rates) / 2] if rate_dps is None else rate_dps,
        temperatures_c[len(temperatures_c) // 2] if temperature_c is None else temperature_c,
        grid=grid,
    )
    return _with_remedy(store, row, answer)


def _with_remedy(store: Store, row: CalibrationRecord, answer: UncertaintyResponse) -> UncertaintyResponse:
    """Return an answer that says where the standards are stated that are missing in U of a version."""
    if not answer.not_stated:
        return answer
    imported = were_imported([store.recordings.get(number) for number in row.recordings])
    return answer.model_copy(update={"not_stated_remedy": remedy_of_unstated(answer.not_stated, imported=imported)})


@single_threaded
def uncertainty_answer(
    calibration: Calibration, rate_dps: Sequence[float], temperature_c: float, *, grid: bool = False
) -> UncertaintyResponse:
    """Return the uncertainty of a calibration's outputs with its budgets, with `grid` also over the validity.

    Raises BadInput, NotEnoughData.
    """
    known = _Known.of(calibration)
    vector = None if len(rate_dps) == 1 else known.at_vector(_vector(rate_dps), temperature_c)
    by_axis = known.at(rate_dps[0], temperature_c) if vector is None else known.of_vector(vector)
    coefficients = coefficient_budgets(
        known.fitted, temperature_c, evidence=known.evidence, name=known.name, bench=known.bench
    )
    budgets = {axis: one.budget.to_json() for axis, one in by_axis.items()}
    response = calibration.document.get("response", {})
    return UncertaintyResponse(
        serial=calibration.serial,
        version=calibration.version,
        rate_dps=math.hypot(*rate_dps) if vector is not None else rate_dps[0],
        temperature_c=temperature_c,
        coverage_factor=COVERAGE,
        coverage=COVERAGE_PROBABILITY,
        inside=is_inside(calibration, rate_dps, temperature_c),
        axes={axis: _response(one) for axis, one in by_axis.items()},
        budget=budgets,
        coefficients={
            axis: {
                **{name: one.to_json() for name, one in named.items()},
                **response.get(axis, {}),
            }
            for axis, named in coefficients.items()
        },
        vector=None if vector is None else _vector_response(vector),
        any_axis=over_any_axis(calibration),
        not_stated=list(dict.fromkeys(name for one in budgets.values() for name in one["not_stated"])),
        overdue=any(one["overdue"] for one in budgets.values()),
        grid=uncertainty_grid(calibration) if grid else None,
    )


def _vector(rate_dps: Sequence[float]) -> dict[str, float]:
    if len(rate_dps) != len(BODY_AXES):
        raise BadInput(
            f"rate_dps has {len(rate_dps)} numbers: give one rate in deg/s, or three, about the body axes x, y and z"
        )
    return dict(zip(BODY_AXES, rate_dps, strict=True))


def _vector_response(uncertainty: RateVectorUncertainty) -> VectorUncertainty:
    return VectorUncertainty(
        rates_dps=dict(uncertainty.rates_dps),
        outputs=list(uncertainty.outputs),
        covariance_dps2=none_for_nan(uncertainty.covariance),
        expanded_dps={axis: budget.expanded for axis, budget in uncertainty.budgets.items()},
        aligned_covariance_dps2=none_for_nan(uncertainty.aligned_covariance),
        aligned_expanded_dps={axis: budget.expanded for axis, budget in uncertainty.aligned_budgets.items()},
    )


def over_any_axis(calibration: Calibration) -> dict[str, AnyAxisUncertainty]:
    """Return output -> its largest U over all rate vectors up to the calibrated rate, as the document states it.

    Nothing where the document states none: an older version of labctl made it, or no uncertainty is defined.
    """
    stated = calibration.document.get("uncertainty")
    by_output = {}
    for axis, bound in stated["axes"].items() if stated is not None else ():
        if (vector := bound.get("vector")) is not None:
            cross = bound.get("cross_rates")
            by_output[axis] = AnyAxisUncertainty.model_validate({**vector, "cross_rates": cross})
    return by_output


@single_threaded
def uncertainty_grid(calibration: Calibration) -> UncertaintyGrid:
    """Return the uncertainty about each axis on a small grid over the validity. Raises BadInput, NotEnoughData."""
    covered, known = Covered(calibration.rate_dps, calibration.temperature_c), _Known.of(calibration)
    rates, temperatures = covered.rates(known.evidence), covered.temperatures()
    grid = [[known.at(rate, at_c) for rate in rates] for at_c in temperatures]
    axes = {axis: [[_response(place[axis]) for place in row] for row in grid] for axis in grid[0][0]}
    over = contributions_over(rates, temperatures, known.at)
    return UncertaintyGrid(rate_dps=rates, temperature_c=temperatures, axes=axes, contributions=over)


def uncertainty_of(calibration: Calibration, rate_dps: float, temperature_c: float) -> dict[str, RateUncertainty]:
    """Return axis -> the uncertainty of a calibration's corrected rate. Raises BadInput, NotEnoughData."""
    return _Known.of(calibration).at(rate_dps, temperature_c)


def widening_of(calibration: Calibration, about: Literal["any axis", "own axis"]) -> float:
    """Return the factor from the largest U of one error to the bound of the largest error; NaN where U is unknown.

    Over all outputs, temperatures and rate vectors up to the calibrated rate, or rates about the axis of each output.
    Raises BadInput, NotEnoughData.
    """
    known, (rates, temperatures) = _Known.of(calibration), places_of(calibration)
    reach = max(map(abs, rates))
    if about == "any axis":
        places = [{a: reach * part for a, part in zip(BODY_AXES, place, strict=True)} for place in PLACES]
        seen = None
    else:
        places = [{axis: rate} for axis in calibration.axes for rate in rates]
        seen = [list(place) for place in places]
    every = [widening([known.at_vector(place, at_c) for place in places], seen) for at_c in temperatures]
    return float(np.max(every))  # NaN where one of them is


def budgets_at(
    calibration: Calibration, rate_dps: float | Mapping[str, float], temperature_c: float
) -> dict[str, Budget]:
    """Return output -> budget of its corrected rate: about its own axis, or at a rate about each body axis.

    Raises BadInput, NotEnoughData.
    """
    known = _Known.of(calibration)
    if isinstance(rate_dps, Mapping):
        return known.at_vector(rate_dps, temperature_c).budgets
    return {axis: uncertainty.budget for axis, uncertainty in known.at(rate_dps, temperature_c).items()}


def coefficients_at(calibration: Calibration, temperature_c: float) -> dict[str, dict[str, Budget]]:
    """Return axis -> coefficient -> its budget at a temperature. Raises BadInput, NotEnoughData."""
    known = _Known.of(calibration)
    return coefficient_budgets(known.fitted, temperature_c, evidence=known.evidence, name=known.name, bench=known.bench)


def places_of(calibration: Calibration) -> tuple[list[float], list[float]]:
    """Return the rates, deg/s, and temperatures, deg C, of a small grid over the validity."""
    covered = Covered(calibration.rate_dps, calibration.temperature_c)
    return list(covered.rates(_Known.of(calibration).evidence)), list(covered.temperatures())


def is_inside(calibration: Calibration, rate_dps: Sequence[float], temperature_c: float) -> bool:
    """Return whether a rate or a rate vector, and a temperature, are within the calibrated ranges.

    A rate vector is where no rate about any axis is faster than the fastest that was calibrated.
    """
    (lowest_c, highest_c), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    if len(rate_dps) == 1:
        return lowest_c <= temperature_c <= highest_c and slow <= rate_dps[0] <= fast
    return lowest_c <= temperature_c <= highest_c and math.hypot(*rate_dps) <= max(abs(slow), abs(fast))


@dataclass(frozen=True)
class _Known:
    """What a document holds of the uncertainty, read once for many places."""

    fitted: FittedModel
    evidence: Mapping[str, AxisEvidence]
    bench: BenchConditions | None  #: None: an older version of labctl made the version
    name: str

    @staticmethod
    def of(calibration: Calibration) -> _Known:
        return _Known(
            calibration.fitted,
            {axis: AxisEvidence.from_json(one) for axis, one in calibration.document.get("use", {}).items()},
            calibration.bench,
            f"{calibration.serial} version {calibration.version}",
        )

    def at_vector(self, rates_dps: Mapping[str, float], temperature_c: float) -> RateVectorUncertainty:
        return rate_vector_uncertainty(
            self.fitted, rates_dps, temperature_c, evidence=self.evidence, name=self.name, bench=self.bench
        )

    def of_vector(self, uncertainty: RateVectorUncertainty) -> dict[str, RateUncertainty]:
        return {axis: of_budget(budget, self.evidence.get(axis)) for axis, budget in uncertainty.budgets.items()}

    def at(self, rate_dps: float, temperature_c: float) -> dict[str, RateUncertainty]:
        return rate_uncertainty(
            self.fitted, rate_dps, temperature_c, evidence=self.evidence, name=self.name, bench=self.bench
        )


def _response(uncertainty: RateUncertainty) -> AxisUncertainty:
    known = asdict(uncertainty)
    known.pop("budget")
    return AxisUncertainty.model_validate(known)
