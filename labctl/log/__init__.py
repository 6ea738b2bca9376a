"""The log: one line per record with named fields, from every process of labctl.

A module takes a logger by `get_logger()` and names what happened in one or two words (`step.ended`), with the values as
keywords. Nothing is written until a process begins its log (`labctl.log.setup`).
"""

from __future__ import annotations

import structlog
from structlog.typing import FilteringBoundLogger

from labctl.log.silence import be_silent

__all__ = ["FilteringBoundLogger", "get_logger"]

if not structlog.is_configured():  # the library's own default writes to standard output, where answers go
    be_silent()


def get_logger(**fields: object) -> FilteringBoundLogger:
    """Return a logger whose records carry these fields."""
    logger: FilteringBoundLogger = structlog.get_logger(**fields)
    return logger
