"""From an error to one clear line on standard error and an exit status."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from labctl.cli.output import complaints


@contextmanager
def one_clear_line() -> Iterator[None]:
    """Turn an error of the house into one line on standard error and its exit status."""
    from instruments.errors import InstrumentError
    from labctl.errors import LabctlError
    from procedures.errors import ProcedureError

    try:
        yield
    except LabctlError as error:
        complaints.print(f"labctl: {error}", markup=False)
        raise typer.Exit(error.exit_status) from error
    except (InstrumentError, ProcedureError) as error:
        complaints.print(f"labctl: {error}", markup=False)
        raise typer.Exit(2) from error
    except KeyboardInterrupt:
        complaints.print("labctl: interrupted", markup=False)
        raise typer.Exit(130) from None
