"""Effects that a person wrote as formulas, beside those of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence

from labctl.errors import BadInput
from labctl.fitting.effects import CATALOGUE, Effect, Formula, formulas


def catalogue_with(written: Sequence[Formula]) -> dict[str, Effect]:
    """Return the catalogue with formulas that compete in it. Raises BadInput for a name that it has."""
    for each in written:
        if each.id in CATALOGUE:
            raise BadInput(f"formula {each.id!r}: the catalogue has an effect of that name; choose another")
    return {**CATALOGUE, **{each.id: each for each in written}}


def with_files(sources: list[str]) -> list[Formula]:
    """Return formulas from lines `name: expression` and from files of this machine; raises BadInput."""
    return [each for source in sources for each in formulas(source)]


def as_lines(sources: list[str]) -> list[str]:
    """Return formulas as lines `name: expression`, with those of files read here; raises BadInput."""
    return [f"{each.id}: {each.text}" for each in with_files(sources)]
