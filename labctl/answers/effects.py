"""The catalogue of effects and of published models."""

from __future__ import annotations

from typing_extensions import TypedDict

from labctl.answers.fitted_model import Origin


class ParameterJson(TypedDict):
    """A nonlinear parameter of an effect."""

    name: str
    """Name of the parameter."""
    unit: str
    """Unit of the parameter."""
    low: int | float
    """Least value that is tried, in `unit`."""
    high: int | float
    """Largest value that is tried, in `unit`."""


class EffectJson(TypedDict):
    """One effect of the catalogue."""

    id: str
    """Id by which fits and criticisms name the effect."""
    term: str
    """Standard term (IEEE Std 528, IEEE Std 952)."""
    sentence: str
    """What the effect is, in one sentence."""
    origin: Origin
    """What the effect belongs to; only those of sensor and package are exported."""
    rows: str
    """Output axes that it shows on: own, the axis that turns; cross, the others; all."""
    needs: list[str]
    """Channels that it needs beside rate and temperature."""
    order: int | None
    """Default polynomial order; null: there is no order to choose."""
    max_order: int | None
    """Largest polynomial order; null: there is no order to choose."""
    parameters: list[ParameterJson]
    """Nonlinear parameters."""
    plausible: dict[str, list[float]]
    """Technology -> least and largest plausible first coefficient, in the unit of the coefficient."""
    aliases: list[str]
    """Ids of effects that no schedule can distinguish from it in one of its shapes."""
    experiment: str
    """What would distinguish it from similar effects; empty: unknown."""
    draws: list[str]
    """Views of a criticism, or channels, in which its signature appears."""


class CataloguedEffect(EffectJson):
    """The same, with what a calibration makes of it."""

    unit: str
    """Unit of the plausible sizes."""
    leaves: bool
    """Whether an exported calibration contains the effect."""


class PresetJson(TypedDict):
    """A model that a fit can be asked for by name."""

    name: str
    """Name of the model."""
    sentence: str
    """What the model is, in one sentence."""
