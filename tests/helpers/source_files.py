"""The project's own Python files, parsed, and which of them import which."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from tests.helpers.paths import ROOT

PACKAGES = ("instruments", "procedures", "labctl")
OTHERS = ("migrations", "tests", "benchmarks", "examples", "mutants", "studies")


@dataclass(frozen=True)
class SourceFile:
    """One Python file."""

    path: Path

    @cached_property
    def text(self) -> str:
        """The file as it is written."""
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        """The file as it is parsed."""
        return ast.parse(self.text)

    @property
    def parts(self) -> tuple[str, ...]:
        """The path from the project's folder."""
        return self.path.relative_to(ROOT).parts

    @property
    def name(self) -> str:
        """The path from the project's folder, as text."""
        return "/".join(self.parts)

    @property
    def is_runtime(self) -> bool:
        """Whether it is part of what is installed."""
        return self.parts[0] in PACKAGES

    @property
    def module(self) -> str:
        """The dotted name under which it is imported."""
        return ".".join(self.parts).removesuffix(".py").removesuffix(".__init__")

    @cached_property
    def functions(self) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
        """Every function and method, nested ones too."""
        return [node for node in ast.walk(self.tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]

    @property
    def imports(self) -> Iterator[str]:
        """Every imported name, absolute: a module, or what is taken from one."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import):
                yield from (alias.name for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                package = self._package(node.level)
                base = ".".join(filter(None, (package, node.module)))
                yield from (f"{base}.{alias.name}" for alias in node.names)

    def _package(self, level: int) -> str:
        """Return the package that `level` leading dots name; empty for an absolute import."""
        return ".".join(self.parts[: len(self.parts) - level]) if level else ""


@cache
def sources() -> tuple[SourceFile, ...]:
    """Return every Python file of the project; links are not followed."""
    found = (path for folder in (*PACKAGES, *OTHERS) for path in (ROOT / folder).rglob("*.py"))
    return tuple(SourceFile(path) for path in sorted(found))


def import_graph(files: tuple[SourceFile, ...]) -> dict[str, set[str]]:
    """Return which of the modules each one imports, anywhere in its text."""
    modules = {file.module for file in files}
    return {file.module: {_module_of(name, modules) for name in file.imports} - {"", file.module} for file in files}


def _module_of(name: str, modules: set[str]) -> str:
    """Return the module that an imported name is, or is in; empty for a foreign one."""
    return next((each for each in (name, name.rpartition(".")[0]) if each in modules), "")


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that reach each other."""
    reach = {module: _reachable(graph, module) for module in graph}
    groups = {frozenset(other for other in reach[module] if module in reach[other]) for module in graph}
    return sorted(sorted(group) for group in groups if len(group) > 1)


def _reachable(graph: dict[str, set[str]], start: str) -> set[str]:
    found: set[str] = set()
    waiting = [start]
    while waiting:
        for module in graph[waiting.pop()] - found:
            found.add(module)
            waiting.append(module)
    return found
