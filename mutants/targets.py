"""What is mutated and which tests are to notice: `targets.toml` as data."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mutants.operators import Mutant

TARGETS = Path(__file__).with_name("targets.toml")


@dataclass(frozen=True)
class Equivalent:
    """A change that no test can notice."""

    before: str  #: the line as it is, without indentation
    after: str
    why: str


@dataclass(frozen=True)
class Target:
    """A module, and the tests that are to notice its mutants."""

    module: str  #: its file, from the root of the repository
    tests: tuple[str, ...]  #: test files, or options of pytest; the quickest first
    equivalent: tuple[Equivalent, ...] = ()

    def why_equivalent(self, mutant: Mutant) -> str | None:
        """Return the reason for which a mutant cannot be noticed; None where it has to be."""
        known = (each.why for each in self.equivalent if (each.before, each.after) == (mutant.before, mutant.after))
        return next(known, None)


def targets() -> tuple[Target, ...]:
    """Return all targets, in the order of the file."""
    document = tomllib.loads(TARGETS.read_text(encoding="utf-8"))
    return tuple(
        Target(each["module"], tuple(each["tests"]), tuple(Equivalent(**same) for same in each.get("equivalent", ())))
        for each in document["target"]
    )
