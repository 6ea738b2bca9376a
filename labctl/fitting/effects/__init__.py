"""Physical effects: one small class each, grouped by family; `catalogue.py` lists the families."""

from __future__ import annotations

from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Span, Term
from labctl.fitting.effects.catalogue import CATALOGUE, describe_effects, effect, kind_of, parse_term
from labctl.fitting.effects.formula import Formula, formulas, read_formula

__all__ = [
    "CATALOGUE",
    "Column",
    "Effect",
    "Formula",
    "Parameter",
    "Reference",
    "Span",
    "Term",
    "describe_effects",
    "effect",
    "formulas",
    "kind_of",
    "parse_term",
    "read_formula",
]
