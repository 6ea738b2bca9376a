"""The catalogue of effects and of published models."""

from __future__ import annotations

from labctl.json_types.effects import CataloguedEffect, PresetJson
from labctl.services.schemas.base import ResponseModel


class CatalogueResponse(ResponseModel):
    """Every effect that a model can be made of, and every model that a fit can be asked for by name."""

    effects: list[CataloguedEffect]
    models: list[PresetJson]
