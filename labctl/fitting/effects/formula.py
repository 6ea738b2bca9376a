"""An effect that a person writes as a formula over logged channels: `name: supply_v * table_rate_dps`.

A formula is read as a tree of a few kinds of nodes and computed by numpy; nothing else of Python can be reached.
"""

from __future__ import annotations

import ast
import operator
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Reference, Rows, Span, Term
from labctl.fitting.numeric.arrays import Array

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin

#: What an operator or function takes and returns.
Operand = float | Array
OPERATORS: Mapping[type, Callable[..., object]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
FUNCTIONS: Mapping[str, Callable[[Operand], Operand]] = {
    name: getattr(np, name) for name in ("exp", "log", "sqrt", "abs", "sin", "cos", "tanh", "sign")
}
#: What a formula may call the rate along the gyro's own axis, besides the names of logged columns.
OWN_RATE = "rate_dps"
#: Names of rates: a formula without any of them is an error of the bias.
RATES = frozenset({OWN_RATE, "table_rate_dps", "previous_rate_dps"})
LONGEST = 500
#: Operations inside each other; a sum of as many terms, too.
DEEPEST = 100
#: At most so many formulas of a request or a command; each is fitted beside every other.
MAX_FORMULAS = 20
#: CPython 3.11 counts how deep a tree is in one place for all threads: two that parse at once fail with a SystemError.
_PARSER = threading.Lock()
NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")


class Formula(Effect):
    """An effect given by a formula; its coefficient multiplies the formula's value."""

    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    term: ClassVar[str] = "Formula"

    def __init__(self, name: str, text: str, sentence: str = "") -> None:
        self.name, self.text = name, text
        self.id = name
        self.sentence = sentence or f"The error follows {text}."
        self._tree = _parsed(name, text)
        names = _names(self._tree)
        self.needs = tuple(sorted(names - {OWN_RATE, "table_rate_dps", "temperature_c"}))
        self.by_temperature = "temperature_c" in names
        self.shows_at_rest = names.isdisjoint(RATES)
        drawn = {"table_rate_dps" if each == OWN_RATE else each for each in names}
        self.draws = tuple("time" if each == "t_s" else each for each in sorted(drawn))

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the text, which is read again."""
        return type(self), (self.name, self.text, self.sentence)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and self.__reduce__() == other.__reduce__()

    def __hash__(self) -> int:
        return hash((self.name, self.text))

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the formula's value; raises BadInput when it is not finite everywhere."""
        values = np.broadcast_to(
            np.asarray(self._value(self._tree.body, channels, axis), dtype=np.float64), len(channels)
        )
        if not np.all(np.isfinite(values)):
            row = int(np.argmin(np.isfinite(values)))
            raise BadInput(
                f"formula {self.name!r}: {self.text} has the value {values[row]} at row {row + 1}; "
                "change the formula so that every value is finite"
            )
        return [Column(self.name, "deg/s per unit of the formula", np.array(values))]

    def options(self, span: Span) -> list[Term]:
        return [Term(self.id, formula=self.text)]

    def _value(self, node: ast.AST, channels: Channels, axis: str) -> Any:
        if isinstance(node, ast.Constant):
            assert isinstance(node.value, int | float)
            return np.float64(node.value)  # whole numbers of Python grow without end: 9**9**9
        if isinstance(node, ast.Name):
            return self._channel(node.id, channels, axis)
        if isinstance(node, ast.UnaryOp):
            return OPERATORS[type(node.op)](self._value(node.operand, channels, axis))
        if isinstance(node, ast.BinOp):
            sides = self._value(node.left, channels, axis), self._value(node.right, channels, axis)
            with np.errstate(all="ignore"):
                return OPERATORS[type(node.op)](*sides)
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        with np.errstate(all="ignore"):
            return FUNCTIONS[node.func.id](self._value(node.args[0], channels, axis))

    def _channel(self, name: str, channels: Channels, axis: str) -> Array:
        if name == OWN_RATE:
            return channels.rate_dps(axis)
        if name == "temperature_c":
            return channels.temperature_c(axis)
        if name not in channels:
            if name == "table_rate_dps" and len(channels.rates) == 1:  # in use the unit turns without a table
                return channels.rate_dps(axis)
            raise BadInput(
                f"formula {self.name!r}: the recording has no column {name!r}; use another column ({OWN_RATE} "
                "is the rate along the gyro's own axis)"
            )
        values = channels[name]
        if values.dtype.kind not in "fiub":
            raise BadInput(
                f"formula {self.name!r}: column {name!r} holds text ({values[0]!s}); use a column of numbers"
            )
        return np.asarray(values, dtype=np.float64)


def _parsed(name: str, text: str) -> ast.Expression:
    if len(text) > LONGEST:
        raise BadInput(f"formula {name!r} has {len(text)} characters; shorten it to at most {LONGEST}")
    try:
        with _PARSER:
            tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        message = error.args[0] if error.args else type(error).__name__
        raise BadInput(
            f"formula {name!r}: {text!r} cannot be read ({message}); write a formula such as 0.02 * (temperature_c - "
            "25)"
        ) from None
    level: list[ast.AST] = [tree.body]
    depth = 0
    while level:
        depth += 1
        if depth > DEEPEST:
            raise BadInput(
                f"formula {name!r}: operations are nested more than {DEEPEST} levels deep; shorten the formula"
            )
        for node in level:
            _check(name, node)
        level = [below for node in level for below in ast.iter_child_nodes(node)]
    return tree


def _check(name: str, node: ast.AST) -> None:
    if isinstance(node, ast.Call):
        is_function = isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS
        if not is_function or len(node.args) != 1 or node.keywords:
            raise BadInput(
                f"formula {name!r}: only {', '.join(FUNCTIONS)} of one value may be called; rewrite the formula with "
                "these"
            )
    elif isinstance(node, ast.Constant):
        if not isinstance(node.value, int | float) or isinstance(node.value, bool):
            raise BadInput(f"formula {name!r}: {node.value!r} is not a number; correct it")
    elif isinstance(node, ast.BinOp | ast.UnaryOp):
        if type(node.op) not in OPERATORS:
            raise BadInput(f"formula {name!r}: an operator is not allowed; use + - * / **")
    elif not isinstance(node, ast.Expression | ast.Name | ast.Load | ast.operator | ast.unaryop):
        raise BadInput(
            f"formula {name!r}: {type(node).__name__} may not be used; write channels, numbers and + - * / **"
        )


def _names(tree: ast.Expression) -> set[str]:
    nodes = list(ast.walk(tree))
    called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
    return {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called}


def read_formulas(lines: Sequence[str]) -> list[Formula]:
    """Read lines `name: formula`; raises BadInput for one that cannot be read, for too many, and for a name twice."""
    return checked_formulas([read_formula(line) for line in lines[: MAX_FORMULAS + 1]])


def checked_formulas(written: list[Formula]) -> list[Formula]:
    """Return the formulas of one request; raises BadInput for too many, and for two of one name."""
    if len(written) > MAX_FORMULAS:
        raise BadInput(f"more than {MAX_FORMULAS} formulas were given, the limit of one comparison; leave some out")
    names = [each.id for each in written]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"formula {name!r} is given twice; give each formula a different name")
    return written


def formulas(source: str) -> list[Formula]:
    """Read `name: formula`, or a TOML file with [[effects]] of `id`, `formula`, perhaps `sentence`. Raises BadInput."""
    return _from_file(Path(source)) if source.endswith(".toml") else [read_formula(source)]


def read_formula(line: str) -> Formula:
    """Read `name: formula`; never a file, so that a line may come from anywhere. Raises BadInput."""
    name, separator, text = line.partition(":")
    if not separator:
        raise BadInput(f"formula {line!r}: write it as 'name: formula'; the command line also takes a .toml file")
    return _made(name.strip(), text.strip(), "")


def _from_file(path: Path) -> list[Formula]:
    from tomllib import TOMLDecodeError  # noqa: PLC0415  a robot's program reads no TOML

    from instruments.toml_documents import read_toml  # noqa: PLC0415

    try:
        records = read_toml(path)["effects"]
        if not isinstance(records, list):
            raise TypeError("[[effects]]")
        return [_made(str(r["id"]), str(r["formula"]), str(r.get("sentence", ""))) for r in records]
    except (OSError, UnicodeDecodeError, TOMLDecodeError) as error:
        raise BadInput(f"formulas {path}: {error}") from error
    except (KeyError, TypeError) as error:
        raise BadInput(f"formulas {path}: an entry in [[effects]] has no key {error}; give id and formula") from error


def _made(name: str, text: str, sentence: str) -> Formula:
    if not NAME.fullmatch(name):
        raise BadInput(
            f"formula name {name!r} is not valid; use small letters, digits and _ only, beginning with a letter"
        )
    return Formula(name, text, sentence)
