"""The loggers of this package: the standard library's, which log nowhere unless the program that uses it wants it."""

from __future__ import annotations

import logging

logging.getLogger("instruments").addHandler(logging.NullHandler())


def logger(module: str) -> logging.Logger:
    """Return the logger of a module of this package."""
    return logging.getLogger(module)
