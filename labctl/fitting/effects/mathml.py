"""MathML of an equation that is written as a Python expression: what a browser draws without a library."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from html import escape

from labctl.fitting.effects.equation import Equation

NAMESPACE = "http://www.w3.org/1998/Math/MathML"
GREEK: Mapping[str, str] = {
    "omega": "ω", "Omega": "Ω", "tau": "τ", "theta": "θ", "Delta": "Δ", "delta": "δ", "pi": "π",
}  # fmt: skip
#: How strongly what an operator joins holds together; atoms hold most strongly.
SUM, PRODUCT, SIGN, POWER, ATOM = range(5)
APPLY, TIMES = "<mo>&#x2061;</mo>", "<mo>&#x2062;</mo>"
#: Between a factor and a function that is written as a word.
SPACE = '<mspace width="0.17em"/>'
COMPARISONS: Mapping[type, str] = {ast.Gt: "&gt;", ast.Lt: "&lt;", ast.GtE: "≥", ast.LtE: "≤", ast.Eq: "="}
#: What stands on both sides of the argument of a function.
FENCES: Mapping[str, tuple[str, str]] = {"abs": ("|", "|"), "floor": ("⌊", "⌋")}
#: Functions of the ranges of a sum, from which two or one bounds are drawn.
STEPS: Mapping[str, str] = {"upto": "{0}", "even": "{0}, 4, …", "odd": "{0}, 5, …"}


def equation_mathml(equation: Equation) -> str:
    """Return an equation and the lines that define what stands in it, as one MathML element `math`."""
    lines = [("e[a]", equation.error), *equation.where]
    rows = "".join(
        f'<mtr><mtd style="text-align: right">{expression(left)}</mtd><mtd><mo>=</mo></mtd>'
        f'<mtd style="text-align: left">{expression(right)}</mtd></mtr>'
        for left, right in lines
    )
    text = "; ".join(f"{left} = {right}" for left, right in lines)
    table = f'<mtable displaystyle="true">{rows}</mtable>'
    return f'<math xmlns="{NAMESPACE}" display="block" alttext="{escape(text)}">{table}</math>'


def symbol_mathml(symbol: str) -> str:
    """Return one symbol, such as `b[k]`, as a MathML element `math`."""
    return f'<math xmlns="{NAMESPACE}" alttext="{escape(symbol)}">{expression(symbol)}</math>'


def expression(text: str) -> str:
    """Return an expression as presentation MathML; raises ValueError for one that has no notation here."""
    return _drawn(ast.parse(text, mode="eval").body)


def _drawn(node: ast.expr, least: int = SUM) -> str:
    """Return a node, in parentheses where it holds together less strongly than `least`."""
    drawing = _DRAWINGS.get(type(node))
    if drawing is None:
        raise ValueError(f"{ast.unparse(node)!r}: {type(node).__name__} has no notation; rewrite the equation")
    drawn = drawing(node)
    return _fenced(drawn) if _strength(node) < least else drawn


def _strength(node: ast.expr) -> int:
    if isinstance(node, ast.IfExp):
        return SUM
    if isinstance(node, ast.UnaryOp):
        return SIGN
    if _function(node) == "sum":
        return PRODUCT
    if not isinstance(node, ast.BinOp) or _is_derivative(node):
        return ATOM
    return {ast.Add: SUM, ast.Sub: SUM, ast.Mult: PRODUCT, ast.Div: POWER, ast.Pow: POWER}[type(node.op)]


def _fenced(drawn: str, left: str = "(", right: str = ")") -> str:
    return f"<mrow><mo>{left}</mo>{drawn}<mo>{right}</mo></mrow>"


def _function(node: ast.AST) -> str:
    return node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""


def _is_word(node: ast.AST) -> bool:
    """Return whether a node begins with a function that is written as a word: sign, log."""
    return len(_function(node)) > 1 and _function(node) not in {"sum", "exp", "sqrt", *FENCES}


def _is_derivative(node: ast.expr) -> bool:
    return isinstance(node, ast.BinOp) and {_function(node.left), _function(node.right)} == {"d"}


def _name(node: ast.Name) -> str:
    base, _, index = node.id.partition("_")
    if base.endswith("dot"):
        return f"<mover><mi>{base.removesuffix('dot')}</mi><mo>˙</mo></mover>"
    drawn = f"<mi>{GREEK.get(base, escape(base))}</mi>"
    if not index:
        return drawn
    upright = "" if len(index) == 1 else ' mathvariant="normal"'
    kind = "mn" if index.isdigit() else "mi"
    return f"<msub>{drawn}<{kind}{upright if kind == 'mi' else ''}>{escape(index)}</{kind}></msub>"


def _constant(node: ast.Constant) -> str:
    return f"<mn>{escape(str(node.value))}</mn>"


def _subscript(node: ast.Subscript) -> str:
    indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    return f"<msub>{_drawn(node.value)}<mrow>{'<mo>,</mo>'.join(map(_drawn, indices))}</mrow></msub>"


def _unary(node: ast.UnaryOp) -> str:
    return f"<mrow><mo>−</mo>{_drawn(node.operand, PRODUCT)}</mrow>"


def _binary(node: ast.BinOp) -> str:
    if _is_derivative(node):
        top, bottom = (side.args[0] for side in (node.left, node.right) if isinstance(side, ast.Call))
        return f"<mfrac><mrow><mi>d</mi>{_drawn(top)}</mrow><mrow><mi>d</mi>{_drawn(bottom)}</mrow></mfrac>"
    if isinstance(node.op, ast.Div):
        return f"<mfrac>{_row(_drawn(node.left))}{_row(_drawn(node.right))}</mfrac>"
    if isinstance(node.op, ast.Pow):
        return f"<msup>{_row(_drawn(node.left, ATOM))}{_row(_drawn(node.right))}</msup>"
    if isinstance(node.op, ast.Mult):
        times = "<mo>·</mo>" if isinstance(node.right, ast.Constant) else TIMES
        gap = SPACE if _is_word(node.right) else ""
        return _row(f"{_drawn(node.left, PRODUCT)}{times}{gap}{_drawn(node.right, PRODUCT)}")
    sign = "+" if isinstance(node.op, ast.Add) else "−"
    return _row(f"{_drawn(node.left)}<mo>{sign}</mo>{_drawn(node.right, PRODUCT)}")


def _row(drawn: str) -> str:
    return f"<mrow>{drawn}</mrow>"


def _call(node: ast.Call) -> str:
    name, arguments = _function(node), node.args
    if name == "sum":
        return _sum(node)
    if name == "exp":
        return f"<msup><mi>e</mi>{_row(_drawn(arguments[0]))}</msup>"
    if name == "sqrt":
        return f"<msqrt>{_drawn(arguments[0])}</msqrt>"
    drawn = "<mo>,</mo>".join(map(_drawn, arguments))
    if name in FENCES:
        return _fenced(drawn, *FENCES[name])
    function = f"<mi>{escape(name)}</mi>" if len(name) > 1 else _drawn(node.func)
    return _row(f"{function if name else _drawn(node.func)}{APPLY}{_fenced(drawn)}")


def _sum(node: ast.Call) -> str:
    (each,) = node.args
    if not isinstance(each, ast.GeneratorExp):
        raise ValueError(f"{ast.unparse(node)!r}: a sum needs 'for ... in ...'; rewrite the equation")
    (loop,) = each.generators
    index, over = _drawn(loop.target), _function(loop.iter)
    assert isinstance(loop.iter, ast.Call)
    bounds = [_drawn(bound) for bound in loop.iter.args]
    sign = "<mo>∑</mo>"
    if over == "others":
        below = f"<munder>{sign}{_row(f'{index}<mo>≠</mo>{bounds[0]}')}</munder>"
    else:
        first = f"<mtext>{STEPS[over].format(ast.unparse(loop.iter.args[0]))}</mtext>" if over != "upto" else bounds[0]
        below = f"<munderover>{sign}{_row(f'{index}<mo>=</mo>{first}')}{_row(bounds[1])}</munderover>"
    return _row(f"{below}{_drawn(each.elt, PRODUCT)}")


def _cases(node: ast.IfExp) -> str:
    cell = '<mtd style="text-align: left">'
    rows = (
        f"<mtr>{cell}{_drawn(node.body)}</mtd>{cell}<mtext>if&#xA0;</mtext>{_condition(node.test)}</mtd></mtr>"
        f"<mtr>{cell}{_drawn(node.orelse)}</mtd>{cell}<mtext>otherwise</mtext></mtd></mtr>"
    )
    return f'<mrow><mo stretchy="true">{{</mo><mtable displaystyle="true">{rows}</mtable></mrow>'


def _condition(node: ast.expr) -> str:
    """Return a condition; a name alone is that of a parameter that is 0 or 1."""
    if isinstance(node, ast.Name):
        return f"<mtext>{escape(node.id)} = 1</mtext>"
    return _drawn(node)


def _comparison(node: ast.Compare) -> str:
    ((operation,), (right,)) = node.ops, node.comparators
    return _row(f"{_drawn(node.left)}<mo>{COMPARISONS[type(operation)]}</mo>{_drawn(right)}")


_DRAWINGS: Mapping[type[ast.expr], Callable[..., str]] = {
    ast.Name: _name,
    ast.Constant: _constant,
    ast.Subscript: _subscript,
    ast.UnaryOp: _unary,
    ast.BinOp: _binary,
    ast.Call: _call,
    ast.IfExp: _cases,
    ast.Compare: _comparison,
}
