"""The catalogue of effects and models, and effects that a user wrote as formulas."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from labctl.errors import BadInput
from labctl.fitting import describe_effects, describe_presets
from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.data.temperature_history import TemperatureHistory
from labctl.fitting.effects import CATALOGUE, Effect, Formula, Reference, Term, checked_formulas, formulas
from labctl.fitting.models.error_model import is_exported
from labctl.json_types.effects import CataloguedEffect
from labctl.services.schemas.calibrations import CatalogueResponse

#: Sizes that are not told as a coefficient: how far the thermometer is off.
OTHER_UNITS = {"thermometer_error": "K"}


def catalogue() -> CatalogueResponse:
    """Return every effect and every model preset as JSON.

    `unit` is that of an effect's plausible sizes; `leaves` says whether a calibration takes it out of the house.
    """
    units = _units()
    effects: list[CataloguedEffect] = [
        {**about, "unit": units[about["id"]], "leaves": is_exported(Term(about["id"]))} for about in describe_effects()
    ]
    return CatalogueResponse(effects=effects, models=describe_presets())


@cache
def _units() -> dict[str, str]:
    """Return the unit of each effect's first coefficient, as its columns name it on a few made-up data sets."""
    position = np.array(["x", "-x", "y", "-y", "z", "-z"])
    n = len(position)
    rate = np.array([10.0, -20.0, 40.0, -60.0, 80.0, 100.0])
    needed = {name for kind in CATALOGUE.values() for name in kind.needs} | {"mounting", "previous_rate_dps"}
    columns: dict[str, Any] = {name: np.arange(1.0, n + 1) for name in needed}
    columns |= {"table_rate_dps": rate, "temperature_c": np.linspace(20.0, 45.0, n), "position": position}
    numbers = tuple(range(1, n + 1))
    channels = Channels(
        columns, body_rates(rate, position), TemperatureHistory(counted={"run": numbers, "mounting": numbers})
    )
    found = {}
    for name, kind in CATALOGUE.items():
        term = Term(name, None, {each.name: each.low for each in kind.parameters})
        found[name] = kind.columns(channels, "z", term, Reference())[0].unit
    return found | OTHER_UNITS


def catalogue_with(written: Sequence[Formula]) -> dict[str, Effect]:
    """Return the catalogue with formulas that compete in it. Raises BadInput for a name that it has."""
    for each in written:
        if each.id in CATALOGUE:
            raise BadInput(f"formula {each.id!r}: the catalogue has an effect of that name; choose another")
    return {**CATALOGUE, **{each.id: each for each in written}}


def with_files(sources: list[str]) -> list[Formula]:
    """Return formulas from lines `name: expression` and from files of this machine; raises BadInput."""
    return checked_formulas([each for source in sources for each in formulas(source)])


def as_lines(sources: list[str]) -> list[str]:
    """Return formulas as lines `name: expression`, with those of files read here; raises BadInput."""
    return [f"{each.id}: {each.text}" for each in with_files(sources)]
