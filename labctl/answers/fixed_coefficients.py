"""Coefficients to be held at known values: the file of `labctl fit --fixed`, and the same in a request."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, model_validator

from labctl.answers.base import LongText, Request
from labctl.answers.recording_head import Axis, OutputUnit

#: Most coefficients of an axis, most temperatures of a table, and the longest text.
MAX_COEFFICIENTS, MAX_TEMPERATURES, LONGEST = 200, 1000, 200

#: The largest size of a value, whose squares are summed, and the least u that differs from 0.
LARGEST, MIN_U = 1e12, 1e-30

Number = Annotated[FiniteFloat, Field(strict=True, ge=-LARGEST, le=LARGEST)]
NotNegative = Annotated[FiniteFloat, Field(strict=True, ge=0, le=LARGEST)]
Celsius = Annotated[FiniteFloat, Field(strict=True, ge=-273.15, le=1e4)]
Text = Annotated[str, Field(max_length=LONGEST)]


class FixedCoefficient(Request):
    """A known coefficient: a number, or a list over temperatures."""

    value: Number | Annotated[list[Number], Field(min_length=1, max_length=MAX_TEMPERATURES)] = Field(
        description="Value of the coefficient, in `unit`; a list: one value for each of `temperature_c`."
    )
    u: NotNegative | Annotated[list[NotNegative | None], Field(max_length=MAX_TEMPERATURES)] | None = Field(
        default=None, description="Standard uncertainty, in the unit of the value; null: not stated."
    )
    unit: Text | None = Field(default=None, description="Checked against the unit that `labctl fit --json` gives.")
    effect: Text | None = Field(default=None, description="Effect of the coefficient; default: by its name.")
    temperature_c: Annotated[list[Celsius], Field(max_length=MAX_TEMPERATURES)] | None = Field(
        default=None, description="Temperatures of a table, rising, deg C; null: one value for all temperatures."
    )

    @model_validator(mode="after")
    def _as_long_as_its_temperatures(self) -> FixedCoefficient:
        temperatures_c = self.temperature_c or []
        lengths = [len(self.value) if isinstance(self.value, list) else 0, len(temperatures_c)]
        if self.u is not None:
            lengths.append(len(self.u) if isinstance(self.u, list) else 0)
        if len(set(lengths)) != 1:
            raise ValueError("value, u and temperature_c must be three lists of the same length, or value a number")
        if any(high <= low for low, high in itertools.pairwise(temperatures_c)):
            raise ValueError("temperature_c must rise")
        return self

    @property
    def values(self) -> tuple[float, ...]:
        """The value at each temperature."""
        return tuple(self.value) if isinstance(self.value, list) else (self.value,)

    @property
    def us(self) -> tuple[float, ...]:
        """The standard uncertainty of each value; NaN where it is not stated."""
        values = self.u if isinstance(self.u, list) else [self.u] * len(self.values)
        return tuple(math.nan if u is None else u if u >= MIN_U else 0.0 for u in values)


def _with_value(document: object) -> object:
    """Take a plain number as a coefficient without uncertainty."""
    return document if isinstance(document, Mapping | FixedCoefficient) else {"value": document}


KnownCoefficient = Annotated[
    FixedCoefficient, BeforeValidator(_with_value, json_schema_input_type=FixedCoefficient | float)
]
KnownCoefficients = Annotated[dict[Text, KnownCoefficient], Field(max_length=MAX_COEFFICIENTS)]


class FixedCoefficients(Request):
    """Known coefficients by axis, each under the name that `labctl fit --json` gives it."""

    source: Annotated[LongText, Field(max_length=LONGEST)] = Field(
        default="", description="Where the values are from, such as a data sheet and its page."
    )
    reference_temperature_c: Celsius | None = Field(
        default=None, description="Reference temperature, deg C, from which the temperature terms count."
    )
    x: KnownCoefficients = Field(default_factory=dict, description="Known coefficients of axis x: name -> value.")
    y: KnownCoefficients = Field(default_factory=dict, description="Known coefficients of axis y: name -> value.")
    z: KnownCoefficients = Field(default_factory=dict, description="Known coefficients of axis z: name -> value.")
    file: Text = Field(default="", description="Name of the file that the values are from; used in messages.")
    argument: Literal["rate", "output"] | None = Field(
        default=None, description="`argument` of the model that the values are from; null: that of the fitted model."
    )
    output: dict[Axis, OutputUnit] = Field(
        default_factory=dict, description="How the outputs that the values are of were converted to deg/s, by axis."
    )
    only_of_model: bool = Field(
        default=False, description="Leave out values of effects that the model does not have; else they are an error."
    )
