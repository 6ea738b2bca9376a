"""The interchange format on disk: a folder with recording.toml, a data file and, perhaps, the environment."""

from __future__ import annotations

import os
import shutil
import tempfile
import tomllib
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO, Literal

from pydantic import ValidationError

from instruments.toml_documents import read_toml, shown
from labctl.errors import BadRecording
from labctl.extras import needs_extra
from labctl.recording.checks import checked, checked_environment
from labctl.recording.info import SERIAL_RULE, RecordingInfo
from labctl.recording.recording import Recording

HEAD = "recording.toml"
ENVIRONMENT = "environment"
FORMATS = ("parquet", "csv")
#: Every name that a file of a recording may have.
FILE_NAMES = frozenset(
    {HEAD, *(f"{stem}.{suffix}" for stem in ("samples", "points", "coefficients", ENVIRONMENT) for suffix in FORMATS)}
)
#: A key that is not known is shown up to here.
LONGEST_PLACE = 80
FileFormat = Literal["parquet", "csv"]


def read_recording(folder: Path) -> Recording:
    """Read a recording from its folder.

    Raises BadRecording, which names the file, the column, the row (1 is the first row below the header) and what was
    expected.
    """
    info = read_head(folder / HEAD)
    with needs_extra("lab", f"{folder}: reading a recording"):
        from labctl.recording.data_files import read_table  # noqa: PLC0415  0.2 s that only files need
    path = _data_file(folder, info.kind)
    columns = checked(path, info, read_table(path))
    environment = None
    for suffix in FORMATS:
        file = folder / f"{ENVIRONMENT}.{suffix}"
        if file.exists():
            environment = checked_environment(file, read_table(file))
            break
    return Recording(info, columns, environment)


def read_head(path: Path) -> RecordingInfo:
    """Read the head of a recording, the file HEAD of its folder. Raises BadRecording."""
    if not path.is_file():
        raise BadRecording(f"{path}: not found; name a folder with {HEAD} and a data file")
    try:
        return RecordingInfo.model_validate(read_toml(path))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadRecording(f"{path}: not TOML: {error}; correct it") from error
    except ValidationError as error:
        # a misspelt key is both unknown and missing: the unknown one is what a person looks for
        first = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        place = ".".join(str(part) for part in first["loc"])[:LONGEST_PLACE]
        value_text = "" if first["type"] == "missing" else f" (is {shown(first['input'])})"
        if (place, first["type"]) == ("serial", "string_pattern_mismatch"):
            raise BadRecording(f"{path}: serial cannot be used{value_text}; give {SERIAL_RULE}") from error
        raise BadRecording(f"{path}: {place}: {first['msg']}{value_text}") from error


def _data_file(folder: Path, kind: str) -> Path:
    candidates = [folder / f"{kind}.{suffix}" for suffix in FORMATS if (folder / f"{kind}.{suffix}").exists()]
    if not candidates:
        raise BadRecording(
            f"{folder}: kind = {kind!r} needs a file {kind}.parquet or {kind}.csv; there is none; add it"
        )
    if len(candidates) > 1:
        raise BadRecording(f"{folder}: both {candidates[0].name} and {candidates[1].name} exist; remove one of them")
    return candidates[0]


def write_recording(recording: Recording, folder: Path, file_format: FileFormat = "parquet") -> list[str]:
    """Write a recording into a new folder and return the names of its files.

    The folder appears whole or not at all. Raises BadRecording when it exists already.
    """
    with needs_extra("lab", f"{folder}: writing a recording"):
        from labctl.recording.data_files import write_table  # noqa: PLC0415  as above

    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadRecording(f"{folder}: exists already and is not empty; name a new folder")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as new_folder:
        whole = Path(new_folder) / "recording"
        whole.mkdir()
        (whole / HEAD).write_bytes(head_of(recording.info))
        write_table(recording.columns, whole / f"{recording.info.kind}.{file_format}")
        if recording.environment is not None:
            write_table(recording.environment, whole / f"{ENVIRONMENT}.{file_format}")
        files = sorted(whole.iterdir())
        for file in (*files, whole):
            _sync(file)
        if folder.exists():
            folder.rmdir()
        shutil.move(whole, folder)
        _sync(folder.parent)
    return [file.name for file in files]


def head_of(info: RecordingInfo) -> bytes:
    """Return the content of recording.toml; what is not known is left out."""
    with needs_extra("lab", "writing a recording"):
        import tomli_w  # noqa: PLC0415  as above

    unstated = {name for name in ("standards", "thermometer", "unread", "left_out") if not getattr(info, name)}
    if info.date_known:
        unstated.add("date_known")
    return tomli_w.dumps(info.model_dump(mode="json", exclude_none=True, exclude=unstated)).encode()


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def recording_parts(opened: ExitStack, folder: Path) -> list[tuple[str, tuple[str, BinaryIO]]]:
    """Open the files of a recording as parts of one form, as an HTTP client sends them; `opened` closes them.

    Raises BadRecording for a folder without any.
    """
    part_paths = [path for path in sorted(folder.glob("*")) if path.name in FILE_NAMES]
    if not part_paths:
        raise BadRecording(f"{folder}: no recording there (expected {HEAD} and a data file)")
    return [("files", (path.name, opened.enter_context(path.open("rb")))) for path in part_paths]
