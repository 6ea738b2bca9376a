"""Spreadsheets (.xlsx, .xls, .ods): a sheet as text with columns, read by calamine where it is installed."""

from __future__ import annotations

import csv
import tempfile
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import Field

from labctl.errors import BadRecording
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.importer import TableImporter
from labctl.recording.logs.recognition import head_of
from labctl.recording.logs.text import TextOptions, read_text
from labctl.recording.raw_table import RawTable

#: Unpacked size of a workbook that is read: a sheet has at most 1,048,576 rows.
MAX_BYTES = 500_000_000
#: First bytes of an .xls file.
_OLD = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_PARTS = ("xl/workbook.xml", "xl/workbook.bin", "content.xml")
INSTALL = "pip install python-calamine"


class SheetOptions(TextOptions):
    """What a user may say about a workbook beside its map."""

    sheet: str | None = Field(default=None, max_length=200)  #: name of the sheet; needed where several hold rows


def probe(path: Path) -> float:
    """Return 0.9 for a workbook: a zip archive with the parts of one, or a file of the older format."""
    if not path.is_file():
        return 0.0
    head = head_of(path)
    if head.startswith(_OLD):
        return 0.9 if path.suffix.lower() == ".xls" else 0.0
    return 0.9 if head.startswith(b"PK\x03\x04") and _is_workbook(path) else 0.0


def read(path: Path, options: SheetOptions) -> RawTable:
    """Return the table of a sheet; raises BadRecording naming the sheets where it must be chosen."""
    _refuse_large(path)
    try:
        from python_calamine import CalamineWorkbook  # noqa: PLC0415  an optional package
    except ImportError as error:
        raise BadRecording(
            f"{path}: this is a spreadsheet, and python-calamine, which reads it, is not installed; install it "
            f"with `{INSTALL}`, or save the sheet as CSV"
        ) from error
    with parsed_by_library(path, "workbook", "save it again, or save the sheet as CSV"):
        book = CalamineWorkbook.from_path(str(path))
        sheets = {name: book.get_sheet_by_name(name) for name in book.sheet_names}
        rows = sheets[_chosen(path, sheets, options.sheet)].to_python(skip_empty_area=False)
    with tempfile.TemporaryDirectory(prefix="labctl-sheet-") as folder:
        csv_file = Path(folder) / "sheet.csv"
        with csv_file.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([_text(cell) for cell in row] for row in rows)
        if not rows:
            raise BadRecording(f"{path}: the sheet is empty; expected readings of a gyro")
        try:
            table = read_text(csv_file, TextOptions.model_validate({**options.model_dump(exclude={"sheet"})}))
        except BadRecording as error:
            raise BadRecording(str(error).replace(str(csv_file), str(path))) from error
    return replace(table, path=path, layout=None)


def _chosen(path: Path, sheets: dict[str, Any], sheet_name: str | None) -> str:
    if sheet_name is not None and sheet_name not in sheets:
        raise BadRecording(f"{path}: there is no sheet {sheet_name!r}; choose one of {', '.join(map(repr, sheets))}")
    filled = [name for name, sheet in sheets.items() if sheet.total_height > 1]
    if sheet_name is None and len(filled) > 1:
        listed = ", ".join(map(repr, filled[:10]))
        raise BadRecording(f"{path}: the sheets {listed} hold rows; choose one with --option sheet=NAME")
    return sheet_name or (filled or list(sheets))[0]


def _text(cell: Any) -> str:
    if hasattr(cell, "isoformat"):
        return str(cell.isoformat())
    return repr(cell) if isinstance(cell, float) else str(cell)


def _is_workbook(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return any(part in archive.namelist() for part in _PARTS)
    except (zipfile.BadZipFile, OSError, ValueError):
        return False


def _refuse_large(path: Path) -> None:
    size = path.stat().st_size
    if head_of(path).startswith(b"PK"):
        with parsed_by_library(path, "workbook", "save it again"), zipfile.ZipFile(path) as archive:
            size = sum(each.file_size for each in archive.infolist())
    if size > MAX_BYTES:
        raise BadRecording(
            f"{path}: {size / 1e6:.0f} MB when unpacked; at most {MAX_BYTES / 1e6:.0f} MB of a workbook are read; "
            "save the sheet as CSV"
        )


IMPORTER = TableImporter("a spreadsheet (.xlsx, .xls, .ods)", probe, read, SheetOptions)
