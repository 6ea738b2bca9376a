"""Physical effects: one small class each, grouped by family; `catalogue.py` lists the families."""

from __future__ import annotations

from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Span, Term
from labctl.fitting.effects.catalogue import CATALOGUE, describe_effects, effect, kind_of, parse_term
from labctl.fitting.effects.formula import (
    MOST_FORMULAS,
    Formula,
    checked_formulas,
    formulas,
    read_formula,
    read_formulas,
)

__all__ = [
    "CATALOGUE",
    "MOST_FORMULAS",
    "Column",
    "Effect",
    "Formula",
    "Parameter",
    "Reference",
    "Span",
    "Term",
    "checked_formulas",
    "describe_effects",
    "effect",
    "formulas",
    "kind_of",
    "parse_term",
    "read_formula",
    "read_formulas",
]
