from labctl.fitting.effects.base import (
    Column as Column,
    Effect as Effect,
    Parameter as Parameter,
    Reference as Reference,
    Span as Span,
    Term as Term,
)
from labctl.fitting.effects.catalogue import (
    CATALOGUE as CATALOGUE,
    describe_effects as describe_effects,
    effect as effect,
    kind_of as kind_of,
    parse_term as parse_term,
)
from labctl.fitting.effects.formula import (
    Formula as Formula,
    MAX_FORMULAS as MAX_FORMULAS,
    checked_formulas as checked_formulas,
    formulas as formulas,
    read_formula as read_formula,
    read_formulas as read_formulas,
)
