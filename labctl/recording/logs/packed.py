"""Packed files (gzip, xz, bzip2): unpacked into a folder that is removed again, and read as what is in them."""

from __future__ import annotations

import bz2
import gzip
import lzma
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from labctl.errors import BadRecording
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.importer import TableImporter
from labctl.recording.logs import arrays, parquet, spreadsheet
from labctl.recording.logs.recognition import MAX_TEXT_BYTES, head_of, refuse_other
from labctl.recording.logs.text import TextOptions, read_text
from labctl.recording.raw_table import RawTable

#: First bytes -> what packed a file, and what opens it.
_PACKERS: tuple[tuple[bytes, str, Callable[[Path], Any]], ...] = (
    (b"\x1f\x8b", "gzip", gzip.GzipFile),
    (b"\xfd7zXZ\x00", "xz", lzma.LZMAFile),
    (b"BZh", "bzip2", bz2.BZ2File),
)
#: Readers of what may be inside, the text last: the first whose probe is above 0 reads it.
_INSIDE: tuple[TableImporter[Any], ...] = (parquet.IMPORTER, arrays.IMPORTER, spreadsheet.IMPORTER)
_BLOCK_BYTES = 1 << 20


def probe(path: Path) -> float:
    """Return 0.9 for a file that begins as one packed by gzip, xz or bzip2 does."""
    return 0.9 if path.is_file() and _packer(path) is not None else 0.0


def read(path: Path, options: TextOptions) -> RawTable:
    """Return the table of what is in a packed file; raises BadRecording naming the packed file."""
    packer = _packer(path)
    if packer is None:
        raise BadRecording(f"{path}: the file is not packed by gzip, xz or bzip2; import it without --format")
    with tempfile.TemporaryDirectory(prefix="labctl-unpacked-") as folder:
        inside = Path(folder) / (path.stem if path.suffix else f"{path.name}.txt")
        _unpack(path, *packer, inside)
        with named_as(path, inside):
            head = head_of(inside)
            for importer in _INSIDE:
                if importer.probe(inside) > 0:
                    return replace(importer.table(inside, importer.options.model_validate({})), path=path)
            refuse_other(inside, head)
            return replace(read_text(inside, options), path=path)


@contextmanager
def named_as(path: Path, inside: Path) -> Iterator[None]:
    """Name the file that a user gave in a refusal of what was made of it."""
    try:
        yield
    except BadRecording as error:
        raise BadRecording(str(error).replace(str(inside), str(path))) from error


def _packer(path: Path) -> tuple[str, Callable[[Path], Any]] | None:
    head = head_of(path)[:8]
    return next(((name, opened) for begin, name, opened in _PACKERS if head.startswith(begin)), None)


def _unpack(path: Path, name: str, opened: Callable[[Path], Any], inside: Path) -> None:
    size = 0
    with parsed_by_library(path, f"{name} file", "copy it again"), opened(path) as packed, inside.open("wb") as file:
        while block := packed.read(_BLOCK_BYTES):
            size += len(block)
            if size > MAX_TEXT_BYTES:
                raise BadRecording(
                    f"{path}: more than {MAX_TEXT_BYTES / 1e6:.0f} MB when unpacked, the most that is read of one "
                    "file; divide it"
                )
            file.write(block)


IMPORTER = TableImporter("a file packed by gzip, xz or bzip2", probe, read, TextOptions)
