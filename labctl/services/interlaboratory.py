"""Comparison of two laboratories or benches by one unit that both have calibrated: En number and zeta score."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from instruments.bench_config import BenchFile
from instruments.standards import Standard
from labctl.answers.validity import ComparedCalibration, ComparedResult, LaboratoryComparison
from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput, Conflict
from labctl.fitting.uncertainty import Budget
from labctl.metrology.interlaboratory import Result, en_number, en_performance, zeta_performance, zeta_score
from labctl.services.cache import UNNAMED, compute
from labctl.services.calibrations.uncertainty import coefficients_at
from labctl.services.standards.usage import performed, same_issuer
from labctl.store import CalibrationRecord, Store

ROOM_C = 25.0


@dataclass(frozen=True)
class _Side:
    """One calibration with what is known of the bench that measured it."""

    row: CalibrationRecord
    calibration: Calibration
    described: ComparedCalibration
    standards: tuple[Standard, ...]


def compare(
    store: Store, first: tuple[str, int], second: tuple[str, int], temperature_c: float | None = None
) -> LaboratoryComparison:
    """Return two versions of one unit compared at a temperature, default: the middle of what both were calibrated at.

    Raises NotFound; BadInput for versions of two units, for ranges without a common temperature, and for a temperature
    outside them; Conflict for versions that rest on the same recording.
    """
    compute(UNNAMED)
    if first[0] != second[0]:
        raise BadInput(
            f"{first[0]} and {second[0]}: En and zeta compare results of one unit; give two versions of one serial "
            "number"
        )
    sides = _side(store, *first), _side(store, *second)
    if shared := set(sides[0].row.recordings) & set(sides[1].row.recordings):
        raise Conflict(
            f"versions {first[1]} and {second[1]} of {first[0]} are both fitted to recording {min(shared)}: nothing "
            "was measured twice; compare versions of two recordings"
        )
    at_c = _temperature(sides, temperature_c)
    shared_standards = [standard for standard in sides[0].standards if _is_shared(standard, sides)]
    results, not_compared = _results(sides, at_c, shared_standards)
    labels = [each.label for each in shared_standards]
    return LaboratoryComparison(
        first=sides[0].described, second=sides[1].described, temperature_c=at_c, results=results, shared=labels,
        not_compared=not_compared,
        satisfactory=bool(results) and all(result.en_performance == "satisfactory" for result in results),
        text=list(_text(results, labels)),
    )  # fmt: skip


def _side(store: Store, serial: str, version: int) -> _Side:
    row = store.calibrations.get(store.units.get(serial).serial, version)
    if not row.recordings:
        raise BadInput(f"{serial} version {version} rests on no recording; compare versions that were measured")
    newest = store.recordings.get(row.recordings[-1])
    campaign = None if newest.campaign is None else store.campaigns.get(newest.campaign)
    laboratory = None if campaign is None else BenchFile.model_validate(campaign.bench).laboratory
    calibration = read_calibration(row.document)
    described = ComparedCalibration(
        serial=row.serial, version=version, bench="" if campaign is None else campaign.bench_name,
        laboratory="" if laboratory is None else laboratory.name, measured_on=performed(store, newest)[0],
    )  # fmt: skip
    return _Side(row, calibration, described, () if calibration.bench is None else calibration.bench.standards)


def _temperature(sides: tuple[_Side, _Side], temperature_c: float | None) -> float:
    ranges = [side.calibration.temperature_c for side in sides]
    ranges_known = [each for each in ranges if all(math.isfinite(end) for end in each)]
    low, high = (
        max((each[0] for each in ranges_known), default=-math.inf),
        min((each[1] for each in ranges_known), default=math.inf),
    )
    if low > high:
        raise BadInput(
            f"the versions have no temperature in common: {ranges[0][0]:g} to {ranges[0][1]:g} and {ranges[1][0]:g} to "
            f"{ranges[1][1]:g} deg C; measure at a common temperature"
        )
    if temperature_c is not None:
        if not low <= temperature_c <= high:
            raise BadInput(
                f"{temperature_c:g} deg C is outside {low:g} to {high:g} deg C, which both have; give one inside"
            )
        return temperature_c
    return (low + high) / 2 if math.isfinite(low) and math.isfinite(high) else ROOM_C


def _is_shared(standard: Standard, sides: tuple[_Side, _Side]) -> bool:
    """Return whether both calibrations rest on one calibration of one standard: its error is the same in both.

    What settings of a bench file state has no certificate: it is one thing only on one bench.
    """
    same = [
        each
        for each in sides[1].standards
        if each.label == standard.label and same_issuer(each.issued_by, standard.issued_by)
    ]
    if not same:
        return False
    first, second = (side.described.bench for side in sides)
    return bool(standard.certificate) or (first != "" and first == second)


def _results(
    sides: tuple[_Side, _Side], at_c: float, shared: Sequence[Standard]
) -> tuple[list[ComparedResult], dict[str, str]]:
    """Return what is compared, and why other results are not."""
    budgets = [coefficients_at(side.calibration, at_c) for side in sides]
    results, left_out = list[ComparedResult](), dict[str, str]()
    keys = dict.fromkeys(
        (axis_of_budget, name) for budget in budgets for axis_of_budget, named in budget.items() for name in named
    )
    for axis, name in keys:
        pair = [budget.get(axis, {}).get(name) for budget in budgets]
        if pair[0] is None or pair[1] is None:
            side = sides[pair[0] is not None].row
            left_out[f"{name} of axis {axis}"] = f"version {side.version} does not have it"
        elif pair[0].combined is None or pair[1].combined is None:
            side = sides[pair[0].combined is not None].row
            left_out[f"{name} of axis {axis}"] = f"its uncertainty in version {side.version} is not known"
        else:
            results.append(_compared(axis, name, pair[0], pair[1], shared))
    return results, left_out


def _compared(axis: str, name: str, first: Budget, second: Budget, shared: Sequence[Standard]) -> ComparedResult:
    covariance = sum(_covariance(first, second, each) for each in shared)
    results = _result(first), _result(second)
    en, zeta = en_number(*results, covariance), zeta_score(*results, covariance)
    return ComparedResult(
        axis=axis, result=name, unit=first.unit, values=(results[0].value, results[1].value),
        expanded=(results[0].expanded, results[1].expanded), k=(results[0].k, results[1].k),
        difference=results[0].value - results[1].value, shared_u=math.sqrt(max(covariance, 0.0)),
        en=en, en_performance=en_performance(en), zeta=zeta, zeta_performance=zeta_performance(zeta),
        en_if_independent=en_number(*results),
    )  # fmt: skip


def _result(budget: Budget) -> Result:
    u = budget.combined or 0.0
    return Result(budget.value or 0.0, u, (budget.expanded or 0.0) / u if u else 2.0)


def _covariance(first: Budget, second: Budget, standard: Standard) -> float:
    """Return what one error of a standard adds to the covariance of two results."""
    product = 1.0
    for budget in (first, second):
        line = next(
            (one for one in budget.lines if one.source == standard.quantity and one.name == standard.label), None
        )
        if line is None or line.sensitivity is None or line.u is None:
            return 0.0
        product *= line.sensitivity * line.u
    return product


def _text(results: Sequence[ComparedResult], shared: Sequence[str]) -> Iterator[str]:
    bad = [result for result in results if result.en_performance != "satisfactory"]
    for each in bad:
        yield (
            f"{each.result} of axis {each.axis}: En = {each.en:.2f}, zeta = {each.zeta:.2f}: the difference "
            f"{each.difference:.4g} {each.unit} is larger than both uncertainties explain. Find the cause in both "
            "laboratories before either result is used."
        )
    if results and not bad:
        yield f"All {len(results)} results agree within their expanded uncertainties (|En| <= 1)."
    if not results:
        yield "No result could be compared."
    if shared:
        yield (
            f"Both calibrations rest on {', '.join(shared)}: they are correlated by it, its part is subtracted, and "
            "the comparison says nothing about it."
        )


def pair_of(text: str) -> tuple[str, int]:
    """Return serial number and version of "SERIAL:VERSION". Raises BadInput."""
    serial, colon, version = text.rpartition(":")
    if not colon or not serial or not version.isascii() or not version.isdecimal():
        raise BadInput(f"{text!r} is not a version; write SERIAL:VERSION, such as FOG-0001:2")
    return serial, int(version)
