"""The changes that are made to a module: those of cosmic-ray that are likely mistakes, and three more.

Cosmic-ray changes comparisons, numbers, conditions and loops. What it lacks are the mistakes of a procedure: a call
that is left out, an answer that is not given, and a list that has become empty.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import parso
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Example, Operator
from cosmic_ray.plugins import get_operator

#: Each comparison from the other side of its boundary, and the opposite; each sum, product and condition the other way.
FROM_COSMIC_RAY = (
    *(
        f"ReplaceComparisonOperator_{pair}"
        for pair in (
            "Lt_LtE", "Lt_GtE", "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE", "GtE_Gt", "GtE_Lt",
            "Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is",
        )
    ),
    *(f"ReplaceBinaryOperator_{pair}" for pair in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Pow_Mul", "Mod_Mul")),
    "ReplaceUnaryOperator_Delete_Not", "ReplaceUnaryOperator_Delete_USub",
    "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd", "AddNot",
    "ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop",
    "NumberReplacer", "ExceptionReplacer", "RemoveDecorator",
)  # fmt: skip
#: Where `*` and `/` are no operators but marks in a list of parameters.
MARKS = frozenset({"parameters", "lambdef", "import_from"})
#: Arguments by which a class only promises what mypy checks: no program of the project changes a frozen object.
PROMISES = frozenset({"frozen", "slots"})
LITERALS = frozenset({"(", "[", "{"})


class CallRemoved(Operator):
    """Leaves out a call whose answer is not used: what it would have done does not happen."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[Any, Any]]:
        """Return the place of a statement that is nothing but a call."""
        if node.type == "simple_stmt" and _is_call(node.children[0]):
            yield node.children[0].start_pos, node.children[0].end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Put `pass` in the place of the call."""
        node.children[0] = parso.parse(f"{_prefix(node.children[0])}pass")
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """Return what the operator does, as code before and after."""
        return (Example("table.stop()\n", "pass\n"),)


class AnswerLost(Operator):
    """Returns None in place of what a function has worked out."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[Any, Any]]:
        """Return the place of a value that is returned."""
        if node.type == "return_stmt" and node.children[1].get_code().strip() != "None":
            yield node.children[1].start_pos, node.children[1].end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Put None in the place of the value."""
        node.children[1] = parso.parse(" None")
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """Return what the operator does, as code before and after."""
        return (Example("def f():\n    return 1\n", "def f():\n    return None\n"),)


class ListEmptied(Operator):
    """Assigns a list, tuple, set or table without its entries."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[Any, Any]]:
        """Return the place of a literal with entries that is assigned."""
        if node.type in {"expr_stmt", "annassign"} and len(_entries(node.children[-1])) > 2:
            yield node.children[-1].start_pos, node.children[-1].end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Put the brackets alone in the place of the literal."""
        entries = _entries(node.children[-1])
        node.children[-1] = parso.parse(f" {entries[0].value}{entries[-1].value}")
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """Return what the operator does, as code before and after."""
        return (Example("PAUSES_S = (2.0, 10.0)\n", "PAUSES_S = ()\n"),)


OWN = (CallRemoved, AnswerLost, ListEmptied)


def _is_call(node: Any) -> bool:
    last = node.children[-1] if node.type in {"atom_expr", "power"} else None
    return last is not None and last.type == "trailer" and last.children[0].value == "("


def _prefix(node: Any) -> str:
    return str(node.get_first_leaf().prefix)


def _entries(node: Any) -> list[Any]:
    literal = node.type == "atom" and getattr(node.children[0], "value", "") in LITERALS
    return list(node.children) if literal else []


@dataclass(frozen=True)
class Mutant:
    """One changed version of a module."""

    operator: str
    line: int  #: of the module as it is
    before: str  #: the lines that the change takes away, without indentation, joined by a space
    after: str  #: those in their place
    code: str

    @property
    def text(self) -> str:
        """The change in one line."""
        return f"line {self.line}: {self.before}  ->  {self.after}"


def mutants_of(source: str) -> list[Mutant]:
    """Return every mutant of a module, by line; those that are no Python, or the same program, are left out."""
    tree = get_ast(source)
    seen = {ast.dump(ast.parse(source))}
    found = []
    for operator in (*(get_operator(f"core/{name}") for name in FROM_COSMIC_RAY), *OWN):
        count = -1
        for node in ast_nodes(tree):
            for _ in operator().mutation_positions(node):
                count += 1
                if _says_nothing(operator.__name__, node):
                    continue
                code = mutate_code(source, operator(), count)
                program = _program(code)
                if program and program not in seen:
                    seen.add(program)
                    found.append(_mutant(operator.__name__, source, code))
    return sorted(found, key=lambda each: (each.line, each.operator))


def _says_nothing(operator: str, node: Any) -> bool:
    """Return whether a change is none, or the same as that of another operator."""
    if operator == "AddNot":  # the opposite of a comparison, and a `not` that is left out, are there already
        return node.children[2 if node.type == "test" else 1].type in {"comparison", "not_test"}
    if node.parent is not None and node.parent.type == "argument":
        return node.parent.children[0].get_code().strip() in PROMISES
    return node.parent is not None and node.parent.type in MARKS


def _program(code: str | None) -> str:
    try:
        return "" if code is None else ast.dump(ast.parse(code))
    except SyntaxError:
        return ""


def _mutant(operator: str, source: str, code: str) -> Mutant:
    before, after = source.splitlines(), code.splitlines()
    first = next(i for i, pair in enumerate(zip(before, after, strict=False)) if pair[0] != pair[1])
    same = 0
    while same < min(len(before), len(after)) - first and before[-1 - same] == after[-1 - same]:
        same += 1
    taken, put = before[first : len(before) - same], after[first : len(after) - same]
    return Mutant(operator, first + 1, _joined(taken), _joined(put), code)


def _joined(lines: list[str]) -> str:
    """Return lines as one, without the space that cosmic-ray puts before what it changes."""
    return re.sub(r"(?<=[(\[{])\s+|\s+(?=\s)", "", " ".join(line.strip() for line in lines)).strip()
