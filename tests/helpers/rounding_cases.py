"""Results as they are shown: value, uncertainty, and (value, uncertainty, power of ten) in words."""

from __future__ import annotations

import math

CASES: list[tuple[float, float | None, tuple[str, str | None, int]]] = [
    (201.27, 3.14, ("201.3", "3.1", 0)),
    (9.06123e-7, 2.04e-9, ("9.061", "0.020", -7)),
    (1.0, 0.0999, ("1.00", "0.10", 0)),
    (0.0, 0.0123, ("0.000", "0.012", 0)),
    (123456.0, 1234.0, ("123500", "1200", 0)),
    (-2.5e7, 1.0e6, ("-2.50", "0.10", 7)),
    (-9.54e-16, 5.14e-16, ("-9.5", "5.1", -16)),
    (0.5, 250.0, ("0", "250", 0)),
    (1.23456, None, ("1.235", None, 0)),
    (1.23456e-9, 0.0, ("1.235", None, -9)),
    (3.0, math.nan, ("3", None, 0)),
    (5.0, 1e-10, ("5.00000000000", "0.00000000010", 0)),
]
