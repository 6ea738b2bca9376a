"""From an error to one clear line on standard error and an exit status."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from labctl.cli.interrupts import INTERRUPTED, signals_restored
from labctl.cli.output import stderr
from procedures.execution.signals import signals_were_obeyed

if TYPE_CHECKING:
    from labctl.errors import BadFile


@contextmanager
def one_clear_line() -> Iterator[None]:
    """Turn an error into one line on standard error and its exit status.

    Raises typer.Exit. The handlers of signals are restored, unless the process ends with this command.
    """
    with signals_restored(), _errors_as_lines():
        yield


@contextmanager
def _errors_as_lines() -> Iterator[None]:
    from pydantic import ValidationError

    from instruments.errors import InstrumentError
    from labctl.answers.storage_url import REFUSED
    from labctl.errors import BadFile, LabctlError, Stopped
    from procedures.contracts.errors import ProcedureError

    try:
        yield
    except Stopped as error:
        signals_were_obeyed()
        raise _exit(str(error), error.exit_status) from error
    except BadFile as error:
        raise _exit_with_all(error) from error
    except LabctlError as error:
        raise _exit(str(error), error.exit_status) from error
    except (InstrumentError, ProcedureError) as error:
        raise _exit(str(error), 2) from error
    except ValidationError as error:
        first = error.errors()[0]
        option = "--" + "-".join(str(part) for part in first["loc"]).replace("_", "-")
        value = "" if first["type"] == REFUSED else f" {first['input']!r}"  # a URL may hold a password
        raise _exit(f"{option}{value}: {first['msg'][0].lower()}{first['msg'][1:]}", 2) from error
    except OverflowError as error:
        raise _exit(f"a number is too large ({error}); give a smaller number", 2) from error
    except OSError as error:
        raise _exit(
            f"{error.filename or 'output'}: {error.strerror or error}; nothing was written; check path, permissions "
            "and free space",
            2,
        ) from error
    except KeyboardInterrupt as error:
        signals_were_obeyed()
        # a further interrupt, while the work that the first one stopped was being closed, changes nothing
        stopped: BaseException | None = error
        while stopped is not None and not isinstance(stopped, Stopped):
            stopped = stopped.__context__
        raise _exit("interrupted" if stopped is None else str(stopped), INTERRUPTED) from None


def _exit_with_all(error: BadFile) -> typer.Exit:
    if len(error.problems) == 1:
        return _exit(str(error), error.exit_status)
    typer_exit = _exit(f"{error.path}: {len(error.problems)} problems; nothing was imported:", error.exit_status)
    for problem in error.problems:
        stderr.print(f"  - {' '.join(problem.split())}")
    return typer_exit


def _exit(text: str, status: int) -> typer.Exit:
    stderr.print(f"labctl: {' '.join(text.split())}")
    return typer.Exit(status)
