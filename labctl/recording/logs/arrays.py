"""Files of named arrays as a table: NumPy (.npy, .npz), MATLAB (.mat of version 5 and 7.3) and HDF5.

_Arrays of one length are the columns; `gyro` of shape (n, 3) is gyro[0], gyro[1] and gyro[2]. HDF5, and MATLAB files of
version 7.3, which are HDF5, need the package h5py.
"""

from __future__ import annotations

import zipfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.column_map.names import is_unit, name_says
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.data_files.limits import checked_names, refuse_too_large, refuse_too_many
from labctl.recording.importer import TableImporter, TableOptions
from labctl.recording.logs.recognition import MAX_LOG_BYTES, head_of, refuse_large
from labctl.recording.raw_table import RawColumn, RawTable

#: Columns that one array may have; the longer side of an array is its rows.
MAX_WIDE = 32
#: _Arrays that a message lists.
_SHOWN = 10
INSTALL = "pip install h5py"
#: Array of a file, by name, and the unit that the file states for it.
_Arrays = dict[str, tuple[NDArray[Any], str]]


def probe(path: Path) -> float:
    """Return 0.9 for a file that begins as one of these formats does."""
    return 0.9 if path.is_file() and _reader(path) is not None else 0.0


def read(path: Path, _: TableOptions) -> RawTable:
    """Return the table of the longest arrays that belong together; raises BadRecording naming what the file has."""
    reader = _reader(path)
    if reader is None:
        raise BadRecording(f"{path}: the file is no .npy, .npz, .mat or HDF5 file; import it without --format")
    refuse_large(path, MAX_LOG_BYTES)
    kind, arrays = reader
    with parsed_by_library(path, kind, "write it again, or write its arrays as CSV"):
        arrays_read = arrays(path)
    columns: dict[int, list[RawColumn]] = defaultdict(list)
    for name, (values, unit) in arrays_read.items():
        for column in _columns(name, values, unit):
            columns[len(column.values)].append(column)
    lengths = sorted((n for n in columns if n > 1), key=lambda n: (not _has_gyro(_without_prefix(columns[n])), -n))
    if not lengths:
        has = (
            ", ".join(f"{name} {values.shape}" for name, (values, _) in list(arrays_read.items())[:_SHOWN]) or "nothing"
        )
        raise BadRecording(f"{path}: no array of numbers with more than one row (it has {has}); write them as CSV")
    if len(lengths) > 1 and _has_gyro(_without_prefix(columns[lengths[1]])):
        both = " and ".join(f"{columns[n][0].name} ({n} rows)" for n in lengths[:2])
        raise BadRecording(f"{path}: arrays of two lengths are outputs of a gyro: {both}; write one of them per file")
    rows, main_columns = lengths[0], _without_prefix(columns[lengths[0]])
    refuse_too_many(path, rows, len(main_columns))
    checked_names(path, [column.name for column in main_columns])
    other_columns = [f"{column.name} ({n})" for n in lengths[1:] for column in columns[n]][:_SHOWN]
    facts = {"notes": f"arrays of other lengths are left out: {', '.join(other_columns)}"} if other_columns else {}
    return RawTable(path, {column.name: column for column in main_columns}, rows, facts=facts)


def _has_gyro(columns: list[RawColumn]) -> bool:
    return any(name_says(column.name).target.startswith("gyro_") for column in columns)


def _without_prefix(columns: list[RawColumn]) -> list[RawColumn]:
    """Return columns of one struct, group or record by the names that they have within it."""
    parts = [column.name.split(".") for column in columns]
    shared = 0
    while all(len(part) > shared + 1 and part[shared] == parts[0][shared] for part in parts):
        shared += 1
    return [replace(column, name=".".join(part[shared:])) for column, part in zip(columns, parts, strict=True)]


def _columns(name: str, values: NDArray[Any], unit: str) -> Iterator[RawColumn]:
    """Yield the columns of an array; none for one that is neither a column nor a table of numbers."""
    if values.dtype.names:
        for field in values.dtype.names:
            yield from _columns(f"{name}.{field}" if name else field, values[field], "")
        return
    values = np.squeeze(values)
    if values.dtype.kind == "M":
        values, unit = values.astype("datetime64[ns]").astype(np.int64), "epoch ns"
    if values.dtype.kind not in "iufb" or values.ndim not in (1, 2):
        return
    if values.ndim == 1:
        yield _column(name or "array", values, unit)
        return
    table = values if values.shape[0] >= values.shape[1] else values.T
    if table.shape[1] <= MAX_WIDE:
        for number in range(table.shape[1]):
            called = f"{name}[{number}]" if name else f"column {number + 1}"
            yield _column(called, table[:, number], unit)


def _column(name: str, values: NDArray[Any], unit: str) -> RawColumn:
    stated = unit if is_unit(unit) else ""
    return RawColumn(name, np.asarray(values, dtype=np.float64), unit=stated, is_boolean=values.dtype.kind == "b")


def _reader(path: Path) -> tuple[str, Callable[[Path], _Arrays]] | None:
    head = head_of(path)
    if head.startswith(b"\x93NUMPY"):
        return "NumPy file", _npy
    if head.startswith(b"PK\x03\x04") and _is_npz(path):
        return "NumPy archive", _npz
    if head.startswith(b"MATLAB 5.0"):
        return "MATLAB file", _mat5
    if head.startswith((b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3")):
        return "HDF5 file", _hdf5
    return None


def _is_npz(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            return bool(names) and all(name.endswith(".npy") for name in names)
    except (zipfile.BadZipFile, OSError, ValueError):
        return False


def _npy(path: Path) -> _Arrays:
    return {"": (np.load(path, mmap_mode="r", allow_pickle=False), "")}


def _npz(path: Path) -> _Arrays:
    with zipfile.ZipFile(path) as archive:
        refuse_too_large(path, sum(each.file_size for each in archive.infolist()))
    arrays_read: _Arrays = {}
    with np.load(path, allow_pickle=False) as archive:
        for name in archive.files:
            try:
                arrays_read[name] = (archive[name], "")
            except ValueError:  # an array of Python objects, which is code that would be run
                continue
    return arrays_read


def _mat5(path: Path) -> _Arrays:
    from scipy.io import loadmat, whosmat  # noqa: PLC0415  0.2 s that only such files need

    shapes = whosmat(str(path))
    refuse_too_large(path, sum(8 * int(np.prod(shape)) for _, shape, _ in shapes))
    opaque = [name for name, _, kind in shapes if kind in {"opaque", "unknown", "object"}]
    arrays_read: _Arrays = {}
    variables = [name for name, _, kind in shapes if kind not in {"opaque", "unknown", "object", "function"}]
    for name, value in loadmat(str(path), squeeze_me=True, struct_as_record=False, variable_names=variables).items():
        if not name.startswith("__"):
            _flatten(name, value, arrays_read)
    if not arrays_read and opaque:
        raise BadRecording(
            f"{path}: {', '.join(opaque[:_SHOWN]) or 'its content'} is a MATLAB table or object, which only MATLAB "
            "reads; write it as CSV in MATLAB: writetable(NAME, 'FILE.csv') (timetable2table first for a timetable)"
        )
    return arrays_read


def _flatten(name: str, value: Any, arrays: _Arrays) -> None:
    """Add the arrays of a variable, those of a struct as NAME.FIELD."""
    if isinstance(value, np.ndarray):
        arrays[name] = (value, "")
    elif fields := getattr(value, "_fieldnames", None):
        for field in fields:
            _flatten(f"{name}.{field}", getattr(value, field), arrays)


def _hdf5(path: Path) -> _Arrays:
    try:
        import h5py  # noqa: PLC0415  an optional package
    except ImportError as error:
        raise BadRecording(
            f"{path}: this is an HDF5 or MATLAB 7.3 file, and h5py, which reads it, is not installed; install it "
            f"with `{INSTALL}`; in MATLAB, save FILE.mat -v7 writes a file that needs no package"
        ) from error
    arrays_read: _Arrays = {}
    with h5py.File(path, "r") as file:
        sets: list[tuple[str, Any]] = []
        file.visititems(lambda name, each: sets.append((name, each)) if isinstance(each, h5py.Dataset) else None)
        usable = [(name, each) for name, each in sets if _is_table(name, each)]
        refuse_too_large(path, sum(8 * each.size * max(len(each.dtype.names or ()), 1) for _, each in usable))
        for name, each in usable:
            arrays_read[name.replace("/", ".")] = (each[()], _unit_of(each.attrs))
    return arrays_read


def _is_table(name: str, each: Any) -> bool:
    """Whether a data set of an HDF5 file is of numbers; MATLAB keeps words and references as numbers too."""
    class_name = each.attrs.get("MATLAB_class", b"")
    is_word = class_name in {b"char", b"cell", "char", "cell"} or name.startswith("#")
    return not is_word and each.shape is not None and (each.dtype.kind in "iufb" or bool(each.dtype.names))


def _unit_of(attributes: Mapping[str, Any]) -> str:
    for key in ("units", "unit", "Units", "Unit"):
        if key in attributes:
            text = attributes[key]
            return text.decode("utf-8", errors="replace") if isinstance(text, bytes) else str(text)
    return ""


IMPORTER = TableImporter("arrays of NumPy, MATLAB or HDF5", probe, read, TableOptions)
