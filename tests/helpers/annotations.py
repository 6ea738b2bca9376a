"""Types as they are written down: whether one mentions Any, and which signatures of a module do."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any, get_args

from tests.helpers.source_files import SourceFile

Function = ast.FunctionDef | ast.AsyncFunctionDef


def mentions_any(annotation: object) -> bool:
    """Return whether a resolved annotation is Any or has it inside."""
    return annotation is Any or any(mentions_any(part) for part in get_args(annotation))


def public_signatures_with_any(file: SourceFile) -> list[str]:
    """Return the public functions, methods, fields and type aliases of a module whose types mention Any, by name."""
    return [name for name, node in _public(file.tree.body, "") if any(_says_any(part) for part in _types_of(node))]


def _public(body: list[ast.stmt], above: str) -> Iterator[tuple[str, ast.stmt]]:
    """Yield what a module or class offers: what begins with no underscore, and the special methods."""
    for node in body:
        for name in _names_of(node):
            if name.startswith("_") and not (name.startswith("__") and above):
                continue
            path = f"{above}{name}"
            yield path, node
            if isinstance(node, ast.ClassDef):
                yield from _public(node.body, f"{path}.")


def _names_of(node: ast.stmt) -> list[str]:
    match node:
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
            return [name]
        case ast.AnnAssign(target=ast.Name(id=name)):
            return [name]
        case ast.Assign(targets=[ast.Name(id=name)]):
            return [name]
        case _:
            return []


def _types_of(node: ast.stmt) -> Iterator[ast.expr]:
    """Yield the type expressions of a definition: of its parameters and result, its bases, a field, an alias."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            taken = node.args
            extra = [each for each in (taken.vararg, taken.kwarg) if each is not None]
            for each in (*taken.posonlyargs, *taken.args, *taken.kwonlyargs, *extra):
                if each.annotation is not None:
                    yield each.annotation
            if node.returns is not None:
                yield node.returns
        case ast.ClassDef():
            yield from node.bases
        case ast.AnnAssign():
            yield node.annotation
        case ast.Assign() if isinstance(node.value, ast.Subscript | ast.BinOp):
            yield node.value


def _says_any(node: ast.expr) -> bool:
    return any(
        (isinstance(part, ast.Name) and part.id == "Any") or (isinstance(part, ast.Attribute) and part.attr == "Any")
        for part in ast.walk(node)
    )
