"""What the project says in words: pages of documentation, and the strings and docstrings of its code."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator

from tests.helpers.openapi import openapi_document
from tests.helpers.paths import ROOT
from tests.helpers.source_files import sources

TOP_LEVEL = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")
#: Strings of JavaScript; comments are cut off first.
JS_COMMENT = re.compile(r"/\*.*?\*/|(?<![:\"'`])//[^\n]*", re.DOTALL)
JS_STRING = re.compile(r"\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|`(?:\\.|[^`\\])*`")
EVERY = re.compile("")
#: Where a text is, and the text.
Written = tuple[str, str]


def documentation() -> Iterator[Written]:
    """Yield every line of the documentation, recipes' and examples' pages too, code blocks as well."""
    folders = [path for folder in ("docs", "labctl/examples") for path in (ROOT / folder).rglob("*.md")]
    for path in [*(ROOT / name for name in TOP_LEVEL), *folders]:
        if "_build" not in path.parts:
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                yield f"{path.relative_to(ROOT)}:{number}", line


def python_strings(having: re.Pattern[str] = EVERY) -> Iterator[Written]:
    """Yield every string of the runtime, docstrings too; of an f-string its fixed parts.

    Only of files `having` something: to parse all takes seconds.
    """
    for file in sources():
        if file.is_runtime and having.search(file.text):
            for node in ast.walk(file.tree):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    yield f"{file.name}:{node.lineno}", node.value


def python_comments(having: re.Pattern[str] = EVERY) -> Iterator[Written]:
    """Yield every comment of the project's Python files, and every docstring outside the runtime.

    Only of files `having` something: to split all into tokens takes seconds.
    """
    for file in sources():
        if file.parts[0] == "migrations" or not having.search(file.text):  # a released revision does not change
            continue
        for token in tokenize.generate_tokens(io.StringIO(file.text).readline):
            if token.type == tokenize.COMMENT:
                yield f"{file.name}:{token.start[0]}", token.string
        if not file.is_runtime:
            documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
            for node in ast.walk(file.tree):
                if isinstance(node, documented) and (text := ast.get_docstring(node)):
                    yield f"{file.name}:{getattr(node, 'lineno', 1)}", text


def field_descriptions() -> Iterator[Written]:
    """Yield the description of every field of the OpenAPI document, in one line as readers see it."""
    for name, schema in openapi_document()["components"]["schemas"].items():
        for field, found in schema.get("properties", {}).items():
            yield f"{name}.{field}", " ".join(found.get("description", "").split())


def page_strings() -> Iterator[Written]:
    """Yield every string of the pages' scripts, and the text of their HTML."""
    for path in sorted((ROOT / "labctl" / "web" / "static").rglob("*")):
        if path.suffix == ".js":
            code = JS_COMMENT.sub("", path.read_text(encoding="utf-8"))
            yield from ((str(path.relative_to(ROOT)), found) for found in JS_STRING.findall(code))
        elif path.suffix == ".html":
            yield str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
