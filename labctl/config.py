"""Where things are when nobody says otherwise."""

from __future__ import annotations

import os
from pathlib import Path

DATABASE_VARIABLE = "LABCTL_DATABASE"


def default_database() -> str:
    """Return the database to use: the environment's, else `labctl.sqlite` in the user's data folder."""
    if named := os.environ.get(DATABASE_VARIABLE):
        return named
    from platformdirs import user_data_path  # noqa: PLC0415  the command line starts in a tenth of a second

    folder = user_data_path("labctl")
    folder.mkdir(parents=True, exist_ok=True)
    return str(Path(folder) / "labctl.sqlite")
