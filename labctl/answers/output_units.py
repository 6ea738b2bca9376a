"""The units of a gyro's output, for programs without pydantic too."""

from __future__ import annotations

import math
from typing import Literal

OutputUnitName = Literal["deg/s", "rad/s", "deg/h", "V", "mV", "count", "arb"]
#: Units that are rates already: what one deg/s is in them.
RATE_UNITS = {"deg/s": 1.0, "rad/s": math.pi / 180.0, "deg/h": 3600.0}
