"""An uncertainty budget: its lines, and what they combine to (GUM, JCGM 100; EA-4/02)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labctl.answers.budget import BudgetJson, BudgetLineJson
from labctl.fitting.uncertainty.combination import combined_u, coverage_factor, effective_freedom, half_width


@dataclass(frozen=True)
class BudgetLine:
    """One source of uncertainty. None is unknown, never 0; `why` says why."""

    source: str  #: "coefficients", "model", "repeatability" or the quantity of a standard
    name: str  #: of the standard, with its certificate
    kind: Literal["A", "B"]  #: evaluated by statistics, or otherwise (GUM 2.3.2, 2.3.3)
    distribution: str
    u: float | None  #: standard uncertainty of the input, in `unit`
    unit: str
    sensitivity: float | None  #: d result / d input, in the unit of the result per `unit`
    contribution: float | None  #: |sensitivity| u, in the unit of the result
    freedom: float | None = None  #: degrees of freedom; None: infinite
    uncorrected: float = 0.0  #: sensitivity times a known error that nothing corrects for, in the unit of the result
    is_common: bool = False  #: whether it is the same at all rates: it adds linearly over them, no mean reduces it
    is_stated: bool = True  #: False: listed and not in U, as a standard that the bench does not state
    is_overdue: bool = False  #: whether the standard was past its due date when it was used
    due: str | None = None
    why: str = ""
    parts: tuple[float, ...] = ()  #: contributions of the independent errors that it is the sum of; (): it is one

    def to_json(self) -> BudgetLineJson:
        """Return this line as JSON."""
        return {
            "source": self.source, "name": self.name, "type": self.kind, "distribution": self.distribution,
            "u": self.u, "unit": self.unit, "sensitivity": self.sensitivity, "contribution": self.contribution,
            "degrees_of_freedom": self.freedom, "uncorrected": self.uncorrected, "common_to_all_rates": self.is_common,
            "stated": self.is_stated, "overdue": self.is_overdue, "due": self.due, "why": self.why,
        }  # fmt: skip


@dataclass(frozen=True)
class Budget:
    """A result with its lines and the combined and expanded uncertainties, all in `unit`."""

    result: str  #: "corrected_rate", or the name of a coefficient
    unit: str
    value: float | None  #: of a coefficient
    lines: tuple[BudgetLine, ...]
    combined: float | None  #: standard; None where a line of type A is unknown
    freedom: float | None  #: effective degrees of freedom; None: infinite
    k: float | None  #: coverage factor for 95.45 %
    expanded: float | None  #: k times combined, widened for known errors that nothing corrects for (`half_width`)

    @property
    def not_stated(self) -> tuple[str, ...]:
        """Sources that nothing states, as standards that the bench does not state: they are not in U."""
        return tuple(dict.fromkeys(line.source for line in self.lines if not line.is_stated))

    @property
    def is_overdue(self) -> bool:
        """Whether a standard was past its due date."""
        return any(line.is_overdue for line in self.lines)

    def to_json(self) -> BudgetJson:
        """Return this budget as JSON."""
        return {
            "result": self.result, "unit": self.unit, "value": self.value,
            "lines": [line.to_json() for line in self.lines], "combined": self.combined,
            "effective_degrees_of_freedom": self.freedom, "k": self.k, "expanded": self.expanded,
            "not_stated": list(self.not_stated), "overdue": self.is_overdue,
        }  # fmt: skip


def budget_of(result: str, unit_symbol: str, lines: Sequence[BudgetLine], value: float | None = None) -> Budget:
    """Return a budget of independent lines.

    Each line is one source at this place; what its inputs have in common is included in it. A line of type A that is
    unknown leaves the result unknown; one that is not stated, as a standard, is listed and not in U.
    """
    stated_lines = [line for line in lines if line.contribution is not None]
    if any(line.contribution is None and line.kind == "A" and line.is_stated for line in lines):
        return Budget(result, unit_symbol, value, tuple(lines), None, None, None, None)
    sizes = [line.contribution or 0.0 for line in stated_lines]
    combined = combined_u(np.array(sizes))
    freedom = effective_freedom(sizes, [line.freedom for line in stated_lines])
    # two independent errors within limits are not one within wider limits: their sum is nearer to a normal one
    parts = [
        (part, line.distribution)
        for line, size in zip(stated_lines, sizes, strict=True)
        for part in line.parts or (size,)
    ]
    k = coverage_factor([part for part, _ in parts], [name for _, name in parts], freedom)
    expanded = half_width(k * combined, sum(line.uncorrected for line in stated_lines))
    return Budget(result, unit_symbol, value, tuple(lines), combined, freedom, k, expanded)


def without_repeatability(lines: Sequence[BudgetLine]) -> float | None:
    """Return the combined standard uncertainty within the power-on of the calibration; None where a part is unknown."""
    other_lines = [line for line in lines if line.source != "repeatability"]
    return budget_of("same_run", "deg/s", other_lines).combined
