"""No log: what a process has that has not begun one."""

from __future__ import annotations

import logging
from collections.abc import MutableMapping
from typing import Any, NoReturn

import structlog


def _drop(_logger: Any, _method: str, _fields: MutableMapping[str, Any]) -> NoReturn:
    raise structlog.DropEvent


def be_silent() -> None:
    """Drop every record from now on."""
    structlog.configure(
        processors=[_drop],
        wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL),
        logger_factory=structlog.ReturnLoggerFactory(),
        cache_logger_on_first_use=False,
    )
