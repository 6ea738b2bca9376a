"""Which records are written, and in which form: from the environment of the process."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping

from labctl.config import LOG_LEVEL_VARIABLE, variable
from labctl.errors import BadInput

LEVELS: Mapping[str, int] = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warning": logging.WARNING,
    "error": logging.ERROR,
    "critical": logging.CRITICAL,
}
#: Of these systemd sets the first where it takes the output into its journal, the second for every service.
SERVICE_MANAGER = ("JOURNAL_STREAM", "INVOCATION_ID")


def level_asked() -> int | None:
    """Return the level that the environment asks for; None where it names none. Raises BadInput."""
    name = variable(LOG_LEVEL_VARIABLE)
    if not name:
        return None
    if name.lower() not in LEVELS:
        raise BadInput(f"{LOG_LEVEL_VARIABLE}={name} is not a log level; set it to one of {', '.join(LEVELS)}")
    return LEVELS[name.lower()]


def is_read_by_a_person(descriptor: int) -> bool:
    """Return whether what is written there is read at a terminal, and by no service manager."""
    managed = any(variable(name) for name in SERVICE_MANAGER)
    try:
        return os.isatty(descriptor) and not managed
    except OSError:
        return False
