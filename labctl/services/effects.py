"""The catalogue of effects and models, and effects that a user wrote as formulas."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from labctl.answers.calibrations import CatalogueResponse
from labctl.answers.effects import CataloguedEffect
from labctl.errors import BadInput
from labctl.fitting import describe_effects, describe_presets
from labctl.fitting.effects import CATALOGUE, Effect, Formula, Term, checked_formulas, effect, formulas
from labctl.fitting.effects.trial import first_column
from labctl.fitting.models.error_model import is_exported

#: Sizes that are not given as a coefficient: how far the thermometer is off.
OTHER_UNITS = {"thermometer_error": "K"}


def catalogue(only: str | None = None) -> CatalogueResponse:
    """Return every effect and every model preset as JSON, or `only` one effect. Raises BadInput for an unknown one.

    `unit` is that of an effect's plausible sizes; `leaves` says whether a calibration exports it.
    """
    units = _units()
    effects: list[CataloguedEffect] = [
        {**about, "unit": units[about["id"]], "leaves": is_exported(Term(about["id"]))} for about in describe_effects()
    ]
    if only is not None:
        return CatalogueResponse(effects=[each for each in effects if each["id"] == effect(only).id], models=[])
    return CatalogueResponse(effects=effects, models=describe_presets())


@cache
def _units() -> dict[str, str]:
    """Return the unit of each effect's first coefficient, as its columns name it on a few made-up data sets."""
    return {name: first_column(kind).unit for name, kind in CATALOGUE.items()} | OTHER_UNITS


def catalogue_with(written: Sequence[Formula]) -> dict[str, Effect]:
    """Return the catalogue with formulas that compete in it. Raises BadInput for a name that it has."""
    for each in written:
        if each.id in CATALOGUE:
            raise BadInput(
                f"formula {each.id!r}: the catalogue already has an effect of that name; choose another name"
            )
    return {**CATALOGUE, **{each.id: each for each in written}}


def with_files(sources: list[str]) -> list[Formula]:
    """Return formulas from lines `name: expression` and from files of this machine; raises BadInput."""
    return checked_formulas([each for source in sources for each in formulas(source)])


def as_lines(sources: list[str]) -> list[str]:
    """Return formulas as lines `name: expression`, with those of files read here; raises BadInput."""
    return [f"{each.id}: {each.text}" for each in with_files(sources)]
