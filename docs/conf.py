"""The documentation as a site: `make docs` builds it, with every warning an error.

Sphinx with MyST, because it reads the same docstrings and Markdown as a person does, checks links, anchors and
pictures, and is maintained (Material for MkDocs ended on 2026-11-05; its successor Zensical is at 0.1).
"""

from __future__ import annotations

import re
from importlib.metadata import version as package_version
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "labctl"
author = "the labctl authors"
project_copyright = author
version = release = package_version("labctl")
language = "en"

extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["_build"]
myst_heading_anchors = 4
autodoc_typehints = "signature"
default_role = "code"  # docstrings write code in single backticks
autodoc_member_order = "bysource"

html_theme = "furo"
html_title = "labctl"
html_show_sphinx = False
html_copy_source = False


def describe_fields(_: Sphinx, what: str, __: str, found: Any, ___: object, lines: list[str]) -> None:
    """Add the description of each field to the documentation of a request or a response."""
    if what == "class" and isinstance(found, type) and issubclass(found, BaseModel):
        fields = {name: field.description or "" for name, field in found.model_fields.items()}
        lines += ["", *(f"* ``{name}``: {text}" if text else f"* ``{name}``" for name, text in fields.items()), ""]


def add_contents(_: Sphinx, page: str, text: list[str]) -> None:
    """Make the sidebar of the lists on the first page, which stay plain Markdown: one for each section."""
    if page != "index":
        return
    for section in re.split(r"^## ", text[0], flags=re.MULTILINE)[1:]:
        caption = section.partition("\n")[0]
        links = re.findall(r"^- \[(.*?)\]\((.*?)\.md\)", section, re.MULTILINE)
        pages = [f"{title} <{name}>" for title, name in links]
        text[0] += "\n".join(["", "```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""])


def setup(app: Sphinx) -> None:
    """Connect what is above; called by Sphinx."""
    app.connect("source-read", add_contents)
    app.connect("autodoc-process-docstring", describe_fields)
