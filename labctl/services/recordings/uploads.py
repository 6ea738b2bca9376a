"""Logs that are sent over HTTP: staged under their own names, inspected, imported, and gone."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, TypeVar

from labctl.errors import BadFile, BadInput, BadRecording
from labctl.recording.column_map import ColumnMap, checked_map, parse_map
from labctl.services.recordings.staging import staging_folder

LONGEST_NAME = 120
ResultT = TypeVar("ResultT")


def with_staged(name: str, content: BinaryIO, modified_ms: float | None, work: Callable[[Path], ResultT]) -> ResultT:
    """Return what `work` returns for a file that holds an upload; raises what it raises, without the staging folder.

    `modified_ms` is when the file was last written, ms since 1970; it is no date of the readings.
    """
    with staging_folder() as folder:
        path = folder / _plain(name)
        with path.open("wb") as target:
            shutil.copyfileobj(content, target)
        if modified_ms is not None:
            os.utime(path, (modified_ms / 1e3, modified_ms / 1e3))
        try:
            return work(path)
        except BadFile as error:
            raise BadFile.of(path.name, error.problems) from None
        except BadRecording as error:
            raise BadRecording(str(error).replace(f"{folder}/", "")) from None
        except BadInput as error:
            raise BadInput(str(error).replace(f"{folder}/", "")) from None


def sent_map(text: str) -> ColumnMap | None:
    """Return the map of a form, as JSON or TOML; None where it is empty. Raises BadInput."""
    if not text.strip():
        return None
    if not text.lstrip().startswith("{"):
        return parse_map(text)
    try:
        return checked_map(json.loads(text))
    except (ValueError, RecursionError) as error:
        raise BadInput(f"map: read as JSON, but not valid: {error}; send JSON or TOML") from error


def _plain(name: str) -> str:
    """Return a file name that is safe in any folder: no path, no special characters."""
    plain_name = re.sub(r"[^\w.+# -]", "_", Path(name.replace("\\", "/")).name)[-LONGEST_NAME:].lstrip(". ")
    return plain_name or "log"
