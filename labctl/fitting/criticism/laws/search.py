"""The search for a law: terms of the library are added one by one, by the evidence for each and a prior on length.

Several beginnings are followed side by side (a beam), because the best first term is often not one of the best pair.
The evidence is that by which effects compete (`evidence`): beside the model, with its noise and drift.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence, evidence_of
from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.noise_grid import Noise
from labctl.fitting.criticism.laws.shapes import TABLE_RATE, TEMPERATURE, Shape
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.effects import Term
from labctl.fitting.effects.formula import Formula
from labctl.fitting.numeric.arrays import Array
from labctl.progress import report_stage

#: Terms at most, and how many beginnings are followed.
MAX_TERMS, BEAM = 4, 3
#: A term is added where it brings so much evidence, nats, beyond the price of its length.
MIN_WORTH = 3.0
#: Price of each symbol of a formula, nats.
PER_SYMBOL = 0.7
#: Of the terms of the library, the best of so many kinds have their constants moved.
REFINED = 8
#: Calls for moving the constants of one term.
MAX_CALLS = 25
#: A noise that is less likely than this beside the model is left out of the search.
MIN_WEIGHT = 0.02
#: Coordinates of formulas that are kept, at most, to be used again.
MAX_KEPT = 20_000
NAME = "law"
NUMBER = re.compile(r"[0-9.]+")
WORD = re.compile(r"[a-z_][a-z0-9_]*")


@dataclass(frozen=True)
class Part:
    """One term of a law, with its constants."""

    shape: Shape
    formulas: tuple[str, ...]


@dataclass(frozen=True)
class State:
    """Terms that were added so far, and the evidence for all of them less the price of their length, nats."""

    parts: tuple[Part, ...] = ()
    score: float = 0.0

    @property
    def formulas(self) -> tuple[str, ...]:
        """The formulas of all terms."""
        return tuple(text for part in self.parts for text in part.formulas)


class Search:
    """A search for laws beside the model of a comparison."""

    def __init__(self, comparison: Comparison, shapes: Sequence[Shape]) -> None:
        self._comparison = comparison
        self._kept: dict[tuple[str, str], NDArray[np.float64]] = {}
        self._shapes = [shape for shape in shapes if self._is_finite(shape)]
        self._others = frozenset(comparison.data.nodes.columns) - {TEMPERATURE, TABLE_RATE}
        # that one of so many shapes fits by chance is in the price of each term
        self._price = float(np.log(max(len(self._shapes), 1)))

    def run(self) -> list[State]:
        """Return the laws that were met, the best first; each has more evidence than any part of it."""
        beam, met = [State()], list[State]()
        for number in range(1, MAX_TERMS + 1):
            report_stage(f"searching a law, term {number}")
            longer = [state for begun in beam for state in self._longer(begun)]
            if not longer:
                break
            longer = _different(sorted(longer, key=lambda state: -state.score))
            met += longer
            beam = longer[:BEAM]
        return _different(sorted(met, key=lambda state: -state.score))

    def _longer(self, begun: State) -> list[State]:
        """Return a state with one term more, in several ways."""
        axes = self._by_axis(begun.formulas, [shape.formulas() for shape in self._shapes])
        worth = sum(axes.values()) - np.array([self._price + PER_SYMBOL * shape.nodes for shape in self._shapes])
        states = []
        best_of_kind: dict[str, int] = {}
        for index in np.argsort(-worth).tolist():
            best_of_kind.setdefault(NUMBER.sub("", self._shapes[index].kind), index)  # powers are of one kind
        for index in list(best_of_kind.values())[:REFINED]:
            strongest = max(axes, key=lambda axis: float(axes[axis][index]))
            part = self._refined(begun, self._shapes[index], strongest)
            gained = float(self._evidence(begun.formulas, [part.formulas])[0]) - self._price_of(part.shape)
            if gained > MIN_WORTH:
                states.append(self._pruned(State((*begun.parts, part), begun.score + gained)))
        return states

    def _pruned(self, state: State) -> State:
        """Return a state without the terms that are not worth their price beside those that came later."""
        for part in state.parts[:-1]:
            others = tuple(each for each in state.parts if each is not part)
            beside = [text for each in others for text in each.formulas]
            worth = float(self._evidence(beside, [part.formulas])[0]) - self._price_of(part.shape)
            if worth < MIN_WORTH:
                state = State(others, state.score - worth)
        return state

    def _price_of(self, shape: Shape) -> float:
        """Return the price of a term whose constants were moved, nats."""
        moved = 0.5 * len(shape.constants) * float(np.log(len(self._comparison.data)))
        return self._price + PER_SYMBOL * shape.nodes + moved

    def _refined(self, begun: State, shape: Shape, axis: str) -> Part:
        """Return a term with the constants that have most evidence on an axis, that on which it shows most."""
        from scipy.optimize import minimize

        names = list(shape.constants)
        if not names:
            return Part(shape, shape.formulas())
        noises = self._likely((*begun.formulas, *shape.formulas()), axis)

        def unlikely(values: Array) -> float:
            constants = dict(zip(names, map(float, values), strict=True))
            evidence = self._on_axis(axis, begun.formulas, [shape.formulas(constants)], noises)
            return -float(max(evidence.log_bf[0], 0.0))

        start = np.array([shape.constants[name] for name in names])
        best = minimize(
            unlikely, start, method="Nelder-Mead", bounds=[shape.bounds[name] for name in names],
            options={"maxfev": MAX_CALLS, "xatol": 1e-3, "fatol": 0.05},
        )  # fmt: skip
        moved = replace(shape, constants=dict(zip(names, map(float, best.x), strict=True)))
        return Part(moved, moved.formulas())

    def _likely(self, beside: Sequence[str], axis: str) -> list[Noise]:
        """Return the noises of an axis that are likely beside the model and formulas."""
        evidence = self._on_axis(axis, beside, (), self._comparison.axes[axis].noises)
        pairs = zip(evidence.noises, evidence.weights, strict=True)
        return [noise for noise, weight in pairs if weight >= MIN_WEIGHT] or [evidence.best.noise]

    def _evidence(self, beside: Sequence[str], tried: Sequence[tuple[str, ...]]) -> Array:
        """Return the log Bayes factor of each option beside the model and formulas, over all axes, nats."""
        return np.asarray(sum(self._by_axis(beside, tried).values()))

    def _by_axis(self, beside: Sequence[str], tried: Sequence[tuple[str, ...]]) -> dict[str, Array]:
        """Return axis -> log Bayes factor of each option, nats; 0 on an axis where it is unlikely."""
        return {
            axis: np.maximum(self._on_axis(axis, beside, tried, known.noises).log_bf, 0.0)
            for axis, known in self._comparison.axes.items()
        }

    def _on_axis(
        self, axis: str, beside: Sequence[str], tried: Sequence[tuple[str, ...]], noises: list[Noise]
    ) -> AxisEvidence:
        of = self._comparison
        return evidence_of(
            self._design(axis, beside, tried), of.data.error_dps(axis), of.white_var[axis], of.scales[axis], noises
        )

    def _design(self, axis: str, beside: Sequence[str], tried: Sequence[tuple[str, ...]]) -> Design:
        design = self._comparison.designs[axis]
        more = [self._columns(axis, text) for text in beside]
        base = np.concatenate([design.base, *more], axis=2)
        precision = np.concatenate([design.precision, np.zeros(len(more))])
        # shapes are centred on what was measured, and need not be made orthogonal to the base as a person's formulas
        return replace(design, base=base, precision=precision, options=[self._option(axis, texts) for texts in tried])

    def _option(self, axis: str, texts: tuple[str, ...]) -> CandidateShape:
        rows = np.concatenate([self._columns(axis, text) for text in texts], axis=2)
        # a formula as an effect would be read again each time
        of = next((name for name in WORD.findall(texts[0]) if name in self._others), TABLE_RATE)
        return CandidateShape(of, None, rows, texts, ("deg/s",) * len(texts))

    def _is_finite(self, shape: Shape) -> bool:
        """Return whether a shape has a value at every row, on every axis."""
        try:
            for axis in self._comparison.designs:
                for text in shape.formulas():
                    self._columns(axis, text)
        except BadInput:
            return False
        return True

    def _columns(self, axis: str, text: str) -> NDArray[np.float64]:
        """Return the coordinates of a formula, (R, m, 1). Raises BadInput where it is not finite everywhere."""
        key = axis, text
        if key not in self._kept:
            data, reference = self._comparison.data, self._comparison.model.reference
            (column,) = Formula(NAME, text).columns(data.nodes, axis, Term(NAME), reference)
            if len(self._kept) >= MAX_KEPT:
                self._kept.clear()
            self._kept[key] = data.rows_of(column.values[:, None])
        return self._kept[key]


def _different(states: Sequence[State]) -> list[State]:
    """Return states without those that have the terms of a better one in another order."""
    by_formulas: dict[frozenset[str], State] = {}
    for state in states:
        by_formulas.setdefault(frozenset(state.formulas), state)
    return list(by_formulas.values())
