"""Lazy faces of packages: a name of a package is imported from its module when it is first asked for.

A package lists its names in `__init__.pyi`, which type checkers read too, so each is declared once (PEP 562, PEP 484).
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module


def install(extra: str) -> str:
    """Return the command that installs what an extra needs."""
    return f"pip install 'labctl[{extra}]'"


def lazy_names(package: str, file: str) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package whose `__init__.py` is `file`.

    Its `__init__.pyi` says `from <module> import <name> as <name>` for each name. Raises AttributeError for others,
    ModuleNotFoundError for one that needs a library of the extra `lab` where that is not installed.
    """
    declared = f"{file.rpartition('.')[0]}.pyi"
    with open(declared, encoding="utf-8") as source:  # noqa: PTH123  pathlib costs a robot's program 4 ms to load
        stub = ast.parse(source.read())
    modules = {
        name.name: str(line.module) for line in stub.body if isinstance(line, ast.ImportFrom) for name in line.names
    }

    def of_module(name: str) -> object:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        try:
            value = getattr(import_module(modules[name]), name)
        except ModuleNotFoundError as error:
            if str(error.name).startswith("labctl"):
                raise
            raise ModuleNotFoundError(
                f"{package}.{name} needs {error.name}, which is not installed; run {install('lab')}", name=error.name
            ) from error
        setattr(sys.modules[package], name, value)  # asked for once
        return value

    names = sorted(modules)
    return of_module, lambda: names, names
