"""Files that only their owner may read and write, whatever the umask is."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

FILE, FOLDER = 0o600, 0o700


def make_private(path: Path) -> None:
    """Make an empty file where there is none. Raises OSError, which names the path."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, FILE)
    except FileExistsError:
        return
    with os.fdopen(handle) as made:
        os.fchmod(made.fileno(), FILE)


def write_private(path: Path, text: str) -> None:
    """Replace the content of a file. Raises OSError, which names the path."""
    make_private(path)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:  # the error of a write does not name the file
        raise OSError(error.errno, error.strerror, str(path)) from error


def close_to_others(*paths: Path) -> None:
    """Remove the access of others to files that an earlier version made; files of another owner stay as they are."""
    for path in paths:
        with suppress(OSError):
            if path.stat().st_mode & 0o777 != FILE:
                path.chmod(FILE)


def make_private_folder(folder: Path) -> None:
    """Make a folder and its parents where they are missing; only the owner may use it. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True, mode=FOLDER)
    with suppress(OSError):
        if folder.stat().st_mode & 0o777 != FOLDER:
            folder.chmod(FOLDER)
