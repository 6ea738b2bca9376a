"""The catalogue of effects and of published models."""

from __future__ import annotations

from typing_extensions import TypedDict

from labctl.json_types.models import Origin


class ParameterJson(TypedDict):
    """A nonlinear parameter of an effect, and between which values it is searched."""

    name: str
    unit: str
    low: int | float
    high: int | float


class EffectJson(TypedDict):
    """One effect of the catalogue."""

    id: str
    term: str
    sentence: str
    origin: Origin
    rows: str
    needs: list[str]
    order: int | None
    max_order: int | None
    parameters: list[ParameterJson]
    plausible: dict[str, list[float]]
    aliases: list[str]
    experiment: str
    draws: list[str]


class CataloguedEffect(EffectJson):
    """The same, with the unit of its plausible sizes, and whether a calibration is exported with it."""

    unit: str
    leaves: bool


class PresetJson(TypedDict):
    """A model that a fit can be asked for by name."""

    name: str
    sentence: str
