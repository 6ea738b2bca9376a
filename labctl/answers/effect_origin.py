"""Where the cause of an effect is."""

from __future__ import annotations

from typing import Literal

Origin = Literal["sensor", "package", "fixture", "bench", "environment"]
