"""The catalogue of effects and of published models."""

from __future__ import annotations

from typing import Literal

from typing_extensions import TypedDict

from labctl.answers.effect_origin import Origin

#: What a symbol of an equation stands for.
SymbolKind = Literal["coefficient", "parameter", "channel", "other"]
#: What a source contains.
Gives = Literal["equation", "definition"]


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
    symbol: str
    """Symbol in the equation of the effect; empty: a switch, which chooses a case of the equation."""
    symbol_mathml: str
    """The symbol as MathML; empty for a switch."""
    meaning: str
    """What the parameter is; empty: an effect of another package does not say."""
    optional: bool
    """Whether a stated shape may leave it out; a switch always may."""
    refined: bool
    """Whether a stated value only begins the fit, which finds the parameter as a coefficient."""


class SymbolJson(TypedDict):
    """A symbol of an equation."""

    symbol: str
    """The symbol as it stands in `text` of the equation."""
    mathml: str
    """The symbol as MathML."""
    kind: SymbolKind
    """What it is: a coefficient, which a fit estimates; a parameter of the shape; a channel of a recording; other."""
    meaning: str
    """What it stands for."""
    unit: str
    """Its unit; 1: of no dimension; empty: an index."""
    name: str
    """Name of the coefficient, the parameter or the column that it stands for; empty: it has none."""


class EquationJson(TypedDict):
    """The error of an output, deg/s, output minus rate, by an effect."""

    text: str
    """The equation as an expression of Python, then the lines that define what stands in it, after semicolons."""
    mathml: str
    """The same as one element `math` of MathML."""
    symbols: list[SymbolJson]
    """Every symbol of the equation, with its meaning and unit."""


class SourceJson(TypedDict):
    """A publication that an effect is from."""

    work: str
    """Author, title and place of the publication, or the standard."""
    place: str
    """Where in it, or what it says there."""
    gives: Gives
    """What it contains: this equation, or the definition of the effect only; the shape is then labctl's own."""


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
    equation: EquationJson | None
    """The equation of the effect; null: an effect of another package does not state it."""
    sources: list[SourceJson]
    """Publications of the equation, or of the definition of the effect."""
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
