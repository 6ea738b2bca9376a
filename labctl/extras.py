"""Libraries that only some uses need: an extra of the package installs them (pyproject.toml)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from labctl.errors import BadInput
from labctl.lazy_imports import install


@contextmanager
def needs_extra(extra: str, purpose: str) -> Iterator[None]:
    """Import inside what needs an extra; raises BadInput where a library of it is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise BadInput(f"{purpose} needs {error.name}, which is not installed; run {install(extra)}") from error
