"""A paper as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Relation = Literal["", "about", "below"]


@dataclass(frozen=True)
class Printed:
    """One number that a paper prints. `value` is None where it prints a figure or a word only."""

    id: str
    place: str  #: such as "Table 3"
    quantity: str
    unit: str
    value: float | None
    relation: Relation = ""  #: the paper says "about", or gives a limit


@dataclass(frozen=True)
class Contradiction:
    """Where a paper contradicts itself or leaves a choice, by its own numbers, and what is done here."""

    place: str
    statement: str
    decision: str


@dataclass(frozen=True)
class Paper:
    """The printed numbers of a paper, in its order, and its contradictions."""

    id: str
    title: str
    citation: str
    printed: tuple[Printed, ...]
    contradictions: tuple[Contradiction, ...]

    def value(self, name: str) -> float:
        """Return a printed number. Raises KeyError where there is none of this name."""
        value_by_id = {each.id: each.value for each in self.printed}[name]
        if value_by_id is None:
            raise KeyError(name)
        return value_by_id
