"""What the catalogue says of an effect: its equation drawn, each symbol explained, and its sources."""

from __future__ import annotations

import ast
import re
from functools import cache

from labctl.answers.effects import EquationJson, ParameterJson, SourceJson, SymbolJson, SymbolKind
from labctl.fitting.effects.base import Effect
from labctl.fitting.effects.equation import CHANNELS, Equation, Symbol
from labctl.fitting.effects.mathml import equation_mathml, symbol_mathml

#: Names in an equation that are functions, or numbers that need no explanation.
WITHOUT_MEANING = frozenset({"e", "pi"})


@cache  # drawing it takes most of the time of an answer, and an effect does not change
def equation_of(effect: Effect) -> EquationJson | None:
    """Return the equation of an effect as JSON; None where the effect declares none."""
    equation = effect.equation
    if equation is None:
        return None
    lines = [("e[a]", equation.error), *equation.where]
    parameters = [Symbol(p.symbol, p.meaning, p.unit, p.name) for p in effect.parameters if p.symbol]
    named = {_stem(each.symbol) for each in (*equation.coefficients, *parameters, *equation.others)}
    channels = [CHANNELS[name] for name in _names(equation) if name not in named and name in CHANNELS]
    kinds: list[tuple[SymbolKind, tuple[Symbol, ...]]] = [
        ("coefficient", equation.coefficients),
        ("parameter", tuple(parameters)),
        ("channel", (CHANNELS["e"], *(each for each in channels if each.symbol not in WITHOUT_MEANING))),
        ("other", equation.others),
    ]
    return {
        "text": "; ".join(f"{left} = {right}" for left, right in lines),
        "mathml": equation_mathml(equation),
        "symbols": [_symbol(each, kind) for kind, symbols in kinds for each in symbols],
    }


def parameters_of(effect: Effect) -> list[ParameterJson]:
    """Return the parameters of an effect as JSON."""
    return [
        {
            "name": p.name,
            "unit": p.unit,
            "low": p.low,
            "high": p.high,
            "symbol": p.symbol,
            "symbol_mathml": symbol_mathml(p.symbol) if p.symbol else "",
            "meaning": p.meaning,
            "optional": p.optional,
            "refined": p.refined,
        }
        for p in effect.parameters
    ]


def sources_of(effect: Effect) -> list[SourceJson]:
    """Return the sources of an effect as JSON."""
    return [{"work": source.work, "place": source.place, "gives": source.gives} for source in effect.sources]


def _symbol(each: Symbol, kind: SymbolKind) -> SymbolJson:
    drawn = symbol_mathml(each.symbol)
    return {
        "symbol": each.symbol, "mathml": drawn, "kind": kind, "meaning": each.meaning, "unit": each.unit,
        "name": each.name,
    }  # fmt: skip


def _stem(symbol: str) -> str:
    return re.split(r"\W", symbol)[0]


def _names(equation: Equation) -> list[str]:
    """Return the names that an equation and its lines use, each once, in order."""
    texts = ("e[a]", equation.error, *(part for line in equation.where for part in line))
    nodes = [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)]
    return list(dict.fromkeys(node.id for node in nodes))
