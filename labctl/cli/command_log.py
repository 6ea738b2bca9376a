"""The log of a command: of a service always, of any other command where the environment asks for it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from labctl.cli.interrupts import process_ends
from labctl.config import LOG_LEVEL_VARIABLE, variable


@contextmanager
def log_of_command(process: str, *, default: str = "", location: str = "") -> Iterator[None]:
    """Log to standard error while the block runs, to the end of the process where it ends with this command.

    Without a level in the environment that of `default` is taken; without both nothing is logged. The password of
    `location`, the address of a database, is removed from every record. Raises BadInput for an unknown level.
    """
    if not (variable(LOG_LEVEL_VARIABLE) or default):
        yield  # and nothing is imported: the command line starts in a tenth of a second
        return
    from labctl.log.settings import LEVELS, level_asked
    from labctl.log.setup import begin_log, running_log

    level = level_asked()
    level = LEVELS[default] if level is None else level
    if process_ends():
        begin_log(process, level, locations=(location,))  # an uncaught error is a record too
        yield
        return
    with running_log(process, level, locations=(location,)):
        yield
