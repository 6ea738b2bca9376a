"""Reads the Acme logger's files: a head of `key: value` lines, then rows with semicolons and decimal commas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from labctl.errors import BadRecording
from labctl.recording import Importer, Recording, RecordingInfo

FIRST_LINE = "ACME-LOG 1"
#: The logger's names -> column of a recording, and what one unit of the logger is in the column's.
COLUMNS = {
    "set": ("dataset", 1.0),
    "time s": ("t_s", 1.0),
    "table dps": ("table_rate_dps", 1.0),
    "temp C": ("temperature_c", 1.0),
    "rate mdps": ("gyro_z", 1e-3),
}


class Options(BaseModel):
    """What a user may say beside the file."""

    model_config = ConfigDict(extra="forbid")

    serial: str | None = None  #: instead of the file's


def probe(path: Path) -> float:
    """Return 1 for a file that begins as the logger's do."""
    if not path.is_file():
        return 0.0
    with path.open("rb") as file:
        return float(file.readline(80).strip() == FIRST_LINE.encode("ascii"))


def read(path: Path, options: Options) -> Recording:
    """Return the recording; raises BadRecording naming the row."""
    head: dict[str, str] = {}
    lines = path.read_text(encoding="utf-8").splitlines()
    number = 1
    while number < len(lines) and ": " in lines[number]:
        key, _, value = lines[number].partition(": ")
        head[key] = value
        number += 1
    if missing := [key for key in ("serial", "started") if key not in head]:
        raise BadRecording(f"{path}: the head has no {' and no '.join(missing)}; expected a line 'serial: ...'")
    names = lines[number].split(";") if number < len(lines) else []
    if names != list(COLUMNS):
        raise BadRecording(f"{path}: line {number + 1}: expected the columns {';'.join(COLUMNS)}")
    rows = [_numbers(path, line, text) for line, text in enumerate(lines[number + 1 :], start=number + 2)]
    values = np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS)).T
    columns = {name: scale * column for (name, scale), column in zip(COLUMNS.values(), values, strict=True)}
    columns["dataset"] = columns["dataset"].astype(np.int64)
    info = RecordingInfo.model_validate(
        {"serial": options.serial or head["serial"], "axes": ("z",), "kind": "samples", "started_at": head["started"]}
    )
    return Recording(info, columns)


def _numbers(path: Path, line: int, text: str) -> list[float]:
    try:
        numbers = [float(word.replace(",", ".")) for word in text.split(";")]
    except ValueError as error:
        raise BadRecording(f"{path}: line {line}: {error}; expected numbers with decimal commas") from error
    if len(numbers) != len(COLUMNS):
        raise BadRecording(f"{path}: line {line}: {len(numbers)} values; expected {len(COLUMNS)}")
    return numbers


IMPORTER = Importer("an Acme logger's file", probe, read, Options)
