"""One quantity of a readout: how it is asked for, and how its reply is read."""

from __future__ import annotations

import re

from pydantic import Field, field_validator

from instruments.bench_config import Strict

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
VALUE = rf"\s*(?P<value>{NUMBER})\s*"
#: Extended replies of Hart and Fluke readouts name the unit: `t: 25.587 C`.
CELSIUS = rf"\s*t:\s*(?P<value>{NUMBER})\s*(?P<unit>[A-Z])\b.*"


class Quantity(Strict):
    """One quantity: how it is asked for, and how its reply is read."""

    ask: str  #: the request, without its line end
    pattern: str = VALUE  #: of the whole reply; group `value`, and `unit` where the reply names it
    unit: str = "deg C"
    says_unit: str = "C"  #: what the reply's group `unit` must be
    resolution: float = Field(default=1e-4, gt=0)  #: readings are kept as whole numbers of this

    @field_validator("pattern")
    @classmethod
    def _has_value(cls, pattern: str) -> str:
        try:
            groups = re.compile(pattern).groupindex
        except re.error as error:
            raise ValueError(f"pattern {pattern!r} is not a regular expression ({error}); correct it") from error
        if "value" not in groups:
            raise ValueError(f"pattern {pattern!r} has no group (?P<value>...) for the number; add one")
        return pattern
