"""Units that never moved: is a cause named that is not there, and does what is advised help on the next record?

Two records of a unit are criticised together beside a parabola of the logged temperature; a third is the next. Right:
an adequate model where nothing but drift, noise and a leaning support is there; the temperature that was not logged, or
no name at all, where one drives the bias; the hysteresis where there is one. Worse: what would be exported after adding
what was advised leaves more of the next record than before.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.effects import Term
from labctl.fitting.estimation.axis_solutions import residuals
from labctl.fitting.estimation.error_metrics import rms
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording, to_points
from studies.rest_records import CELLS, TYPES, Unit, record

#: Units of a cell and type.
UNITS = int(os.environ.get("LABCTL_REST_UNITS", "6"))
#: Names that are right in each cell.
RIGHT: Mapping[str, frozenset[str]] = {"hysteresis": frozenset({"thermal_hysteresis"})}
UNLOGGED = "unlogged temperature"
#: Records that are criticised together; the one after them is the next.
RECORDS = 2


@dataclass(frozen=True)
class Outcome:
    """What one unit gave."""

    form: str
    named: tuple[str, ...]
    hypothesis: bool
    advised: tuple[str, ...]
    next_before_dps: float  #: of the next record, but for its turn-on bias
    next_after_dps: float

    def is_right(self, cell: str) -> bool:
        """Whether the verdict is the true one."""
        if cell == UNLOGGED:
            return self.hypothesis
        right = RIGHT.get(cell, frozenset())
        return set(self.named) == right if right else self.form == "adequate"

    def is_false(self, cell: str) -> bool:
        """Whether a cause is named that is not there."""
        return bool(set(self.named) - RIGHT.get(cell, frozenset())) or (self.hypothesis and cell != UNLOGGED)

    @property
    def is_worse(self) -> bool:
        """Whether what was advised makes the next record worse, by more than rounding."""
        return self.next_after_dps > 1.001 * self.next_before_dps


def outcome(kind: str, cell: str, seed: int, *, records: int = RECORDS) -> Outcome:
    """Simulate, fit, criticise, add what is advised, and correct the next record by what would be exported."""
    unit = Unit.made(seed, kind)
    made = {number: record(unit, CELLS[cell], number, seed=seed) for number in range(1, records + 2)}
    following = to_points(made.pop(records + 1))
    recording = joined_recording(made)
    points = to_points(recording)
    data = fit_data_of(points)
    base = fit_preset(data, preset_for("bias_temperature", []))
    found = criticise(recording, base.fitted.model, points=points)
    advised = tuple(each["effect"] for each in found.advice if each["add"])
    terms = tuple(term for term in _terms(found) if term.effect in advised)
    after = fit_preset(data, changed(base.fitted.model, terms)) if terms else base
    return Outcome(
        found.verdict.form, found.verdict.named, found.verdict.hypothesis is not None, advised,
        _next(base, following), _next(after, following),
    )  # fmt: skip


def _terms(found: Criticism) -> tuple[Term, ...]:
    return tuple(found.verdict.terms.values())


def _next(result: FitResult, following: Recording) -> float:
    """Return the error of another record corrected by what would be exported, deg/s, but for its mean."""
    exported, _ = result.fitted.exported()
    left = residuals(exported, fit_data_of(following), {})
    return rms({axis: values - values.mean() for axis, values in left.items()}) or 0.0


def lines() -> Iterator[str]:
    """Yield the table, row by row."""
    yield f"   n = {UNITS} units of each type, {RECORDS} records of 2.8 h each and the next"
    yield f"   {'type':12} {'cell':22} right %  false name %  advised %  next worse %   next before, after (median dps)"
    for kind in TYPES:
        for cell in CELLS:
            found = [outcome(kind, cell, seed) for seed in range(UNITS)]
            shares = (
                [one.is_right(cell) for one in found],
                [one.is_false(cell) for one in found],
                [bool(one.advised) for one in found],
                [one.is_worse for one in found],
            )
            right, false, advised, worse = (100.0 * float(np.mean(share)) for share in shares)
            before, after = np.median([(one.next_before_dps, one.next_after_dps) for one in found], axis=0)
            wrong = sorted({"+".join(one.named) or one.form for one in found if not one.is_right(cell)})
            yield (
                f"   {kind:12} {cell:22} {right:7.0f} {false:13.0f} {advised:10.0f} {worse:13.0f}   {before:.2g}, "
                f"{after:.2g}   {', '.join(wrong)}"
            )


def run() -> str:
    """Return the table."""
    return "\n".join(lines())


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
