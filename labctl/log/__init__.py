"""The log: one line per record with named fields, from every process of labctl.

A module takes a logger by `get_logger()` and names what happened in one or two words (`step.ended`), with the values as
keywords. Nothing is written until a process begins its log (`labctl.log.setup`).
"""

from __future__ import annotations

import sys
from functools import cached_property
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from structlog.typing import FilteringBoundLogger

__all__ = ["get_logger"]

LEVELS = frozenset({"debug", "info", "warning", "error", "exception", "critical", "log"})


def get_logger(**fields: object) -> FilteringBoundLogger:
    """Return a logger whose records carry these fields."""
    return cast("FilteringBoundLogger", _Logger(fields))


class _Logger:
    """A logger that does not load structlog, which takes 40 ms: `setup` does, and before it nothing is logged."""

    def __init__(self, fields: dict[str, object]) -> None:
        self._fields = fields

    @cached_property
    def _logger(self) -> FilteringBoundLogger:
        import structlog  # noqa: PLC0415  as above

        from labctl.log.silence import be_silent  # noqa: PLC0415  as above

        if not structlog.is_configured():  # the library's own default writes to standard output, where answers go
            be_silent()
        logger: FilteringBoundLogger = structlog.get_logger(**self._fields)
        return logger

    def __getattr__(self, name: str) -> object:
        if name.startswith("_"):  # asked for by copy, pickle and the like
            raise AttributeError(name)
        if "structlog" not in sys.modules and name in LEVELS:
            return _drop
        return getattr(self._logger, name)


def _drop(*_event: object, **_fields: object) -> None:
    """Log nothing: no log has begun."""
