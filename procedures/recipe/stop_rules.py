"""When a campaign has measured enough: the uncertainty of a corrected rate at which it ends before its plan does."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from procedures.recipe.fit_rules import ModelName
from procedures.recipe.rules import Number, Table, Yes


def _rising(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] <= ends[1]:
        raise ValueError("the first number is above the second; give the lower end first")
    return ends


#: Both ends of a range.
Ends = Annotated[tuple[Number, Number], AfterValidator(_rising)]


class StopRules(Table):
    """A campaign ends early once U of its fit is small enough at every rate and temperature of a range.

    U is the expanded uncertainty (95 %) of a corrected rate about the axis of each output, as a calibration states it.
    """

    u_dps: Number = Field(gt=0)  #: U at which the campaign ends
    rates_dps: Ends | None = None  #: absent: from the lowest rate of the recipe to the highest
    temperature_c: Ends | None = None  #: of the chamber's set point; absent: all temperatures of the recipe
    model: ModelName | None = None  #: that is fitted; absent, without effects: that of [fit]
    effects: tuple[ModelName, ...] = Field(default=(), max_length=50)  #: beside the model
    #: Whether U counts the difference of a later power-on, as U of a calibration does.
    repeatability: Yes = True

    @model_validator(mode="after")
    def _of_something(self) -> StopRules:
        if self.model is None and not self.effects:
            raise ValueError(
                'nothing says what is fitted; name a model (model = "ojeda2000") or effects here, or write [fit]'
            )
        return self


def outside(name: str, range_: Ends | None, measured: tuple[float, ...], unit_symbol: str) -> str:
    """Return by how much a range asks for more than a recipe measures, in words; empty where it does not."""
    if range_ is None or not measured or (min(measured) <= range_[0] and range_[1] <= max(measured)):
        return ""
    return (
        f"stop.{name} = [{range_[0]:g}, {range_[1]:g}] {unit_symbol} goes beyond what the recipe measures, "
        f"{min(measured):g} to {max(measured):g} {unit_symbol}; narrow stop.{name}, or measure there too"
    )
