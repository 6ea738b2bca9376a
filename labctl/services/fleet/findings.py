"""Findings on a type as answers: its coefficients, groups, outliers and ageing, and what its model is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from labctl.answers.fleet import (
    FleetAgeing,
    FleetCoefficientFigures,
    FleetGroup,
    FleetMissing,
    FleetOutlier,
    FleetSize,
)
from labctl.errors import NotEnoughData
from labctl.fitting.fleet.ageing import ageing_of
from labctl.fitting.fleet.findings import GroupEffect
from labctl.fitting.fleet.group_effects import DATE
from labctl.fitting.fleet.population import population_of
from labctl.fitting.fleet.type_evidence import TypeEffect, judged
from labctl.fitting.fleet.type_sums import TypeSums
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients
from labctl.probability_text import odds_text
from labctl.services.fleet.evidence import sums_in
from labctl.shown_unit import shown_unit, size_text
from labctl.store import Store
from labctl.texts import counted

#: Outliers of a report, at most; its text says how many there are.
MAX_OUTLIERS = 100


@dataclass(frozen=True)
class Compared:
    """What the units have in common."""

    units: int = 0
    left_out: int = 0
    coefficients: list[FleetCoefficientFigures] = field(default_factory=list)
    groups: list[FleetGroup] = field(default_factory=list)
    outliers: list[FleetOutlier] = field(default_factory=list)
    text: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Evidence:
    """What the model of a type is missing, by so many units."""

    units: int = 0
    missing: list[FleetMissing] = field(default_factory=list)
    text: list[str] = field(default_factory=list)


def population_in(units: Sequence[UnitCoefficients]) -> Compared:
    """Compare the coefficients of units."""
    try:
        population = population_of(units)
    except NotEnoughData as error:
        return Compared(text=[f"{_capital(str(error))}."])
    groups = [_group(each) for each in population.effects]
    outliers = [
        FleetOutlier(serial=each.serial_number, coefficient=each.coefficient, t=each.t, text=each.reason)
        for each in population.outliers
    ]
    sentences = [f"{len(population.table)} units were compared."]
    sentences += [each.text for each in groups] or [
        "No batch, bench, supplier or trend differs from the rest of the type."
    ]
    if outliers:
        unlike = len({each.serial for each in outliers})
        sentences.append(f"{counted(unlike, 'unit')} {'is' if unlike == 1 else 'are'} not like the type.")
    if population.left_out:
        first = population.left_out[0]
        left_out = len(population.left_out)
        verb = "was" if left_out == 1 else "were"
        sentences.append(f"{counted(left_out, 'unit')} {verb} left out, first {first.serial_number}: {first.reason}.")
    return Compared(
        len(population.table),
        len(population.left_out),
        [
            FleetCoefficientFigures.model_validate(
                {name: getattr(each, name) for name in FleetCoefficientFigures.model_fields}
            )
            for each in population.coefficients
        ],
        groups,
        outliers[:MAX_OUTLIERS],
        sentences,
    )


def _group(effect: GroupEffect) -> FleetGroup:
    named, per = ", ".join(effect.coefficients), " per year" if effect.factor == DATE else ""
    shown = shown_unit(effect.unit, next(iter(effect.coefficients), ""))
    shift, u = f"{shown.number(effect.shift, 3)} {shown.unit}{per}", shown.number(effect.u)
    by = f"{shift} (u = {u}, {effect.units} units, p = {effect.p_value:.1g})"
    if effect.factor == DATE:
        text = f"{named} changes with the date of the measurement by {by}."
    elif effect.is_of_bench:
        text = (
            f"Bench {effect.level} shifts {named} of all units on it by {by}: an error of the bench, not of the units."
        )
    else:
        text = f"{_capital(effect.factor)} {effect.level} differs in {named} by {by}."
    if effect.same_as:
        others = ", ".join(f"{factor} {level}".strip() for factor, level in effect.same_as)
        text = f"{text[:-1]}; {others} would explain it as well."
    return FleetGroup(
        factor=effect.factor, level=effect.level, coefficients=list(effect.coefficients), shift=effect.shift,
        u=effect.u, unit=effect.unit, units=effect.units, p_value=effect.p_value, of_bench=effect.is_of_bench,
        text=text,
    )  # fmt: skip


def ageing_in(units: Sequence[UnitCoefficients]) -> tuple[list[FleetAgeing], list[str]]:
    """Return the change per year of each coefficient, and a sentence on it."""
    try:
        ageings = ageing_of(units)
    except NotEnoughData as error:
        return [], [f"Ageing: {error}."]
    answers = [
        FleetAgeing.model_validate({name: getattr(each, name) for name in FleetAgeing.model_fields}) for each in ageings
    ]
    return answers, [f"Ageing was evaluated from units with calibrations {_years(ageings[0].over_years)} apart."]


def _years(over: tuple[float, float]) -> str:
    return f"{over[0]:.2g} to {over[1]:.2g} years"


def evidence_in(store: Store, type_: str, model: str, *, whole: bool) -> Evidence:
    """Add the evidence of all units of a type; `whole`: the report is on all of them."""
    if not whole:
        return Evidence(text=["What the type is missing is judged by all of its units; leave out the other filters."])
    contents, not_current = store.fleet_reports.evidence(type_, model)
    sums = TypeSums()
    for content in contents:
        if (part := sums_in(content)).complete:
            sums.merge(part)
        else:
            not_current += part.units
    evidence = judged(sums)
    sentences = [f"What the model of the type is missing was judged by the criticisms of {sums.units} units."]
    if evidence.reason:
        sentences = [f"What the model is missing: {evidence.reason}; `labctl fleet criticise` does it."]
    if not_current:
        sentences.append(
            f"The criticisms of {not_current} units do not count, as others that were added to them were made again, "
            "or an older program made them; `labctl fleet criticise --again` makes all again."
        )
    missing = [_missing(each) for each in evidence.named]
    sentences += [each.text for each in missing]
    if not missing and not evidence.reason:
        sentences.append("No effect is named for the type by all units together.")
    return Evidence(sums.units, missing, sentences)


def _missing(effect: TypeEffect) -> FleetMissing:
    sizes = [
        FleetSize(axis=s.axis, name=s.name, unit=s.unit, mean=s.mean, u_mean=s.u_mean, spread=s.spread)
        for s in effect.sizes
    ]
    size = "; ".join(
        f"{s.axis}.{s.name} {size_text(s.mean, s.unit, s.name, 3)} (u = {size_text(s.u_mean, s.unit, s.name)})"
        for s in sizes[:3]
    )
    who = "The type is missing" if effect.of_bench is None else f"Bench {effect.of_bench} adds to all its units"
    text = (
        f"{who} {' or '.join(effect.group)}: {size}; the odds for it from all units together are "
        f"{odds_text(effect.log_bayes_factor)}, while single units show {effect.rms_unit_z:.1f} standard uncertainties."
    )
    return FleetMissing(
        effects=list(effect.group), log_bayes_factor=effect.log_bayes_factor, common=effect.is_common, sizes=sizes,
        rms_unit_z=effect.rms_unit_z, of_bench=effect.of_bench, text=text,
    )  # fmt: skip


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
