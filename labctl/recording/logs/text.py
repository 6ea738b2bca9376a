"""Text files of any layout as a table: CSV, tabs, semicolons, blanks, decimal commas, with or without a header."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pacsv
from pydantic import Field

from labctl.errors import BadRecording
from labctl.recording.column_map.model import FileKeys
from labctl.recording.column_map.problems import rows_text
from labctl.recording.data_files.last_line import cut_last_line
from labctl.recording.data_files.limits import MAX_COLUMNS, refuse_too_many
from labctl.recording.importer import TableImporter, TableOptions
from labctl.recording.logs.encoding import BLOCK_BYTES, TextStream
from labctl.recording.logs.layout import layout_of, split
from labctl.recording.logs.recognition import MAX_TEXT_BYTES, head_of, refuse_large, refuse_other
from labctl.recording.raw_table import SHOWN_ROWS, FileLayout, RawColumn, RawTable

#: Cells that say that there is no number.
_MISSING = pa.array(["", "nan", "na", "n/a", "null", "none", "-nan"])
_NUMBER = r"^[+-]?([0-9]+([.][0-9]*)?|[.][0-9]+)([eE][+-]?[0-9]+)?$|^[+-]?(?i:inf|infinity)$"
#: Wrong cells that are remembered.
MAX_WRONG_CELLS = 20
#: A column is of words where more than this share of its cells are no numbers.
WORDS = 0.5
LONGEST_WORD = 64
MAX_LINE_BYTES = 1 << 20


def column_of(name: str, pieces: Sequence[pa.Array], decimal: str, unit: str = "") -> RawColumn:
    """Return a column from its cells as text, piece by piece in the order of the file."""
    wrong: list[tuple[int, str]] = []
    numbers, n_wrong, row = [], 0, 0
    for piece in pieces:
        values, wrong_cells, count = _numbers(piece, decimal)
        wrong += [(row + index + 1, text) for index, text in wrong_cells[: MAX_WRONG_CELLS - len(wrong)]]
        numbers.append(values)
        n_wrong += count
        row += len(piece)
    whole = np.concatenate(numbers) if numbers else np.zeros(0)
    filled = int(np.isfinite(whole).sum()) + n_wrong
    if n_wrong > WORDS * filled:
        return RawColumn(name, whole, words=_words(pieces), unit=unit)
    return RawColumn(name, whole, unit=unit, wrong=tuple(wrong), n_wrong=n_wrong)


def _numbers(piece: pa.Array, decimal: str) -> tuple[Any, list[tuple[int, str]], int]:
    """Return the numbers of a piece, (n,), nan where there is none, the first wrong cells, and the number of all."""
    if decimal == ".":
        try:
            return np.asarray(piece.cast(pa.float64())), [], 0
        except pa.ArrowInvalid:
            pass
    text = pc.utf8_trim_whitespace(piece)
    if decimal == ",":
        text = pc.replace_substring(text, ",", ".")
    missing = pc.is_in(pc.utf8_lower(text), _MISSING)
    number = pc.match_substring_regex(text, _NUMBER)
    values = pc.if_else(number, text, "nan").cast(pa.float64())
    bad = np.flatnonzero(~np.asarray(pc.or_(number, missing)))
    return np.asarray(values), [(int(row), piece[int(row)].as_py()) for row in bad[:MAX_WRONG_CELLS]], len(bad)


def _words(pieces: Sequence[pa.Array]) -> np.ndarray[Any, np.dtype[np.str_]]:
    parts = []
    for piece in pieces:
        coded = pc.utf8_slice_codeunits(pc.utf8_trim_whitespace(piece), 0, LONGEST_WORD).dictionary_encode()
        parts.append(np.array(coded.dictionary.to_pylist(), dtype=np.str_)[np.asarray(coded.indices)])
    return np.concatenate(parts)


#: How sure the importer is of a text: any other that knows a file is surer.
SURENESS = 0.1


class TextOptions(TableOptions):
    """What a user may say about a text file beside its map."""

    file: FileKeys = Field(default=FileKeys(), exclude=True)


def probe(path: Path) -> float:
    """Return a low confidence for a file that is text, 0 for anything else."""
    if not path.is_file() or path.suffix.lower() == ".parquet":
        return 0.0
    try:
        head = head_of(path)
        refuse_other(path, head)
        layout_of(path, head, FileKeys())
    except BadRecording:
        return 0.0
    return SURENESS


def read_text(path: Path, options: TextOptions) -> RawTable:
    """Return the table of a text file, all columns; raises BadRecording for what is no table of numbers."""
    head = head_of(path)
    refuse_other(path, head)
    refuse_large(path, MAX_TEXT_BYTES)
    layout, header = layout_of(path, head, options.file)
    names = header.names
    _refuse_names(path, names)
    blocks, ragged = _blocks(path, layout, names)
    cut = cut_last_line(path, layout.encoding, layout.separator)
    if cut is not None:
        blocks, ragged = _without_last(blocks, ragged)
    rows = sum(block.num_rows for block in blocks)
    if rows == 0:
        raise BadRecording(f"{path}: no row of {len(names)} columns below the header; expected at least one")
    columns = {}
    for name, unit in zip(names, header.units, strict=True):
        pieces = [block.column(name) for block in blocks]
        columns[name] = column_of(name, pieces, layout.decimal, unit)
        blocks = [block.drop_columns([name]) for block in blocks]
    return RawTable(
        path,
        {name: column for name, column in columns.items() if not column.is_empty or not name.startswith("column ")},
        rows,
        tuple(_ragged_lines(ragged, len(names), layout)),
        layout,
        first_rows=_first_rows(head, layout, names),
        unread=cut,
    )


def _without_last(blocks: list[Any], ragged: list[tuple[int, int]]) -> tuple[list[Any], list[tuple[int, int]]]:
    """Return the rows of a file without its last line, which is among those of another width or among the blocks."""
    rows = sum(block.num_rows for block in blocks) + len(ragged)
    if ragged and ragged[-1][0] in (0, rows):
        return blocks, ragged[:-1]
    last = next((k for k in reversed(range(len(blocks))) if blocks[k].num_rows), None)
    if last is None:
        return blocks, ragged
    return [*blocks[:last], blocks[last].slice(0, blocks[last].num_rows - 1)], ragged


def _refuse_names(path: Path, names: list[str]) -> None:
    if len(names) > MAX_COLUMNS:
        raise BadRecording(
            f"{path}: the file has {len(names)} columns, but at most {MAX_COLUMNS} are allowed; remove the "
            "columns that are not needed"
        )
    doubled = sorted({name for name in names if names.count(name) > 1})
    if doubled:
        listed = ", ".join(repr(name[:60]) for name in doubled[:5])
        raise BadRecording(f"{path}: {listed} occurs more than once in the header; give each column a different name")


def _blocks(path: Path, layout: FileLayout, names: list[str]) -> tuple[list[Any], list[tuple[int, int]]]:
    """Return the rows as batches, and the number (0: not known) and the width of each row of another width.

    The threads of pyarrow get no object of Python: one that takes the interpreter's lock while it ends aborts it.
    """
    ragged: list[tuple[int, int]] = []
    blocks: list[Any] = []
    before = rows = 0

    def wrong_width(row: Any) -> str:
        ragged.append((0 if row.number is None else before + row.number - skipped, row.actual_columns))
        return "skip"

    parse = pacsv.ParseOptions(
        delimiter="\t" if layout.separator == " " else layout.separator, invalid_row_handler=wrong_width
    )
    convert = pacsv.ConvertOptions(
        column_types=dict.fromkeys(names, pa.string()), strings_can_be_null=False, quoted_strings_can_be_null=False
    )
    skipped = layout.data - 1
    with closing(TextStream(path, layout.encoding, blanks=layout.separator == " ")) as stream:
        for piece in _whole_lines(stream):
            options = pacsv.ReadOptions(
                column_names=names, skip_rows=skipped, use_threads=False, block_size=piece.size + 1
            )
            try:
                read = pacsv.read_csv(pa.BufferReader(piece), options, parse, convert)
            except pa.ArrowInvalid as error:
                if "Empty CSV" in str(error):  # lines of the head, or blank ones
                    continue
                raise BadRecording(
                    f"{path}: row {rows + 1} or later: {str(error).splitlines()[0][:200]}; correct it"
                ) from error
            blocks += read.to_batches()
            rows += read.num_rows
            refuse_too_many(path, rows, len(names))
            before, skipped = rows + len(ragged), 0
    return blocks, ragged


def _whole_lines(stream: TextStream) -> Iterator[pa.Buffer]:
    """Yield a text in pieces of whole lines, each in memory of pyarrow's own."""
    left = b""
    while piece := stream.read(BLOCK_BYTES):
        text = left + piece
        end = max(text.rfind(b"\n"), text.rfind(b"\r")) + 1
        left = text[end:]
        if len(left) > MAX_LINE_BYTES:
            raise BadRecording(
                f"{stream.path}: a line has more than {MAX_LINE_BYTES >> 20} MiB; write one row of readings on each "
                "line"
            )
        if end:
            yield _copied(text[:end])
    if left:
        yield _copied(left)


def _copied(text: bytes) -> pa.Buffer:
    with pa.BufferOutputStream() as copy:
        copy.write(text)
        return copy.getvalue()


def _ragged_lines(ragged: list[tuple[int, int]], width: int, layout: FileLayout) -> list[str]:
    if not ragged:
        return []
    counts = sorted({count for _, count in ragged})
    had = ", ".join(map(str, counts[:5]))
    mark = {"\t": "tab", " ": "blanks"}.get(layout.separator, repr(layout.separator))
    rows = rows_text([row for row, _ in ragged])
    advice = "correct or leave out these rows"
    return [f"{rows}: {had} columns where the others have {width} (separator {mark}); {advice}"]


def _first_rows(head: bytes, layout: FileLayout, names: list[str]) -> list[list[str]]:
    text = head.decode("utf-8-sig" if layout.encoding == "utf-8" else layout.encoding, errors="ignore")
    lines = [line for line in text.splitlines()[layout.data - 1 :] if line.strip()]
    return [split(line, layout.separator)[: len(names)] for line in lines[:SHOWN_ROWS]]


IMPORTER = TableImporter("a text file with columns (CSV)", probe, read_text, TextOptions)
