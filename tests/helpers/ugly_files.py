"""Logs as people have them, of one unit at rest that warms up: the files of `test_ugly_files` are made here.

Random numbers and columns are numpy's alone; spreadsheets are written by openpyxl, HDF5 by h5py, MATLAB files by scipy.
"""

from __future__ import annotations

import bz2
import csv
import gzip
import io
import lzma
import zipfile
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

RATE_HZ = 100.0
NAMES = ("t", "gx", "gy", "gz", "T")
UNITS = ("s", "deg/s", "deg/s", "deg/s", "degC")
#: 2024-01-25T08:00:00Z
EPOCH_S = 1_706_169_600
STARTED = datetime(2024, 1, 25, 8, 0, 0)  # noqa: DTZ001  the files have no zone

Maker = Callable[[Path], Path]


def truth(n: int = 1000) -> np.ndarray:
    """Return time in s, three outputs in deg/s and a temperature in deg C, (n, 5), as every file has them."""
    random = np.random.default_rng(20240125)
    t_s = np.arange(n) / RATE_HZ
    rates = np.array([0.3, -0.2, 0.1]) + 0.05 * random.standard_normal((n, 3))
    return np.column_stack([t_s, rates, 24.0 + 0.15 * t_s + 0.01 * random.standard_normal(n)])


def names(units: Sequence[str] = UNITS) -> list[str]:
    """Return the names of the columns with their units in brackets; none for an empty unit."""
    return [f"{name} [{unit}]" if unit else name for name, unit in zip(NAMES, units, strict=True)]


def lines(header: Sequence[Sequence[str]], rows: Sequence[Sequence[object]], separator: str = ",") -> str:
    """Return a text with rows of a header."""
    made = io.StringIO()
    csv.writer(made, delimiter=separator, lineterminator="\n").writerows([*header, *rows])
    return made.getvalue()


def numbers(stamps: Sequence[object] | None = None, *, rows: np.ndarray | None = None, decimal: str = ".") -> list:
    """Return the cells of the rows, the first replaced by stamps."""
    rows = truth() if rows is None else rows
    cells = [[f"{value:.6f}".replace(".", decimal) for value in row] for row in rows]
    return cells if stamps is None else [[stamp, *row[1:]] for stamp, row in zip(stamps, cells, strict=True)]


def text(content: str, name: str = "log.csv", encoding: str = "utf-8") -> Maker:
    """A text file."""

    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content.encode(encoding))
        return folder / name

    return make


def log(stamps: Sequence[object] | None, unit: str = "", *, stamp: str = "t", units: Sequence[str] = UNITS) -> Maker:
    """A CSV file with stamps in place of the times, in a unit that the name states, or does not."""
    header = [f"{stamp} [{unit}]" if unit else stamp, *names(units)[1:]]
    return text(lines([header], numbers(stamps)))


def clock(factor: float, start: float = 0.0) -> list[int]:
    """Whole numbers of a clock that counts `factor` in a second."""
    return [round(start * factor + k * factor / RATE_HZ) for k in range(len(truth()))]


def dates(form: str, *, start: datetime = STARTED, digits: int = 6) -> list[str]:
    """Dates in a form of strftime, %f with so many digits."""
    made = [start + timedelta(seconds=k / RATE_HZ) for k in range(len(truth()))]
    return [each.strftime(form.replace("%f", f"{each:%f}"[:digits])) for each in made]


def warm(temperature: Callable[[np.ndarray], np.ndarray], name: str = "temp") -> Maker:
    """A CSV file with a temperature of any values under a name without unit."""
    rows = truth()
    rows[:, 4] = temperature(np.linspace(0.0, 1.0, len(rows)))
    return text(lines([[*names()[:4], name]], numbers(rows=rows)))


def packed(maker: Maker, pack: Callable[[bytes], bytes], ending: str) -> Maker:
    """A file packed by a program."""

    def make(folder: Path) -> Path:
        inside = maker(folder)
        made = folder / f"{inside.name}{ending}"
        made.write_bytes(pack(inside.read_bytes()))
        return made

    return make


def gz(maker: Maker) -> Maker:
    return packed(maker, gzip.compress, ".gz")


def xz(maker: Maker) -> Maker:
    return packed(maker, lzma.compress, ".xz")


def bz(maker: Maker) -> Maker:
    return packed(maker, bz2.compress, ".bz2")


def zipped(maker: Maker) -> Maker:
    def pack(content: bytes) -> bytes:
        made = io.BytesIO()
        with zipfile.ZipFile(made, "w") as archive:
            archive.writestr("log.csv", content)
        return made.getvalue()

    return packed(maker, pack, ".zip")


def raw(content: bytes, name: str) -> Maker:
    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return make


def workbook(*sheets: tuple[str, Sequence[Sequence[object]]]) -> Maker:
    """An .xlsx file, by openpyxl."""

    def make(folder: Path) -> Path:
        from openpyxl import Workbook

        book = Workbook()
        book.remove(book.active)
        for title, rows in sheets:
            sheet = book.create_sheet(title)
            for row in rows:
                sheet.append(list(row))
        book.save(folder / "log.xlsx")
        return folder / "log.xlsx"

    return make


def cells() -> list[list[object]]:
    """The rows as a spreadsheet has them: numbers, not text."""
    return [[float(value) for value in row] for row in truth()]


def npz(**arrays: object) -> Maker:
    def make(folder: Path) -> Path:
        np.savez(folder / "log.npz", **{name: np.asarray(values) for name, values in arrays.items()})
        return folder / "log.npz"

    return make


def npy(array: np.ndarray) -> Maker:
    def make(folder: Path) -> Path:
        np.save(folder / "log.npy", array)
        return folder / "log.npy"

    return make


def parquet(names: Sequence[str], rows: np.ndarray, zeroed: tuple[int, slice] | None = None) -> Maker:
    """A Parquet file; with exact zeros in some rows of one column, as an erased page without a checksum leaves them."""

    def make(folder: Path) -> Path:
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = dict(zip(names, rows.copy().T, strict=True))
        if zeroed is not None:
            columns[names[zeroed[0]]][zeroed[1]] = 0.0
        pq.write_table(pa.table(columns), folder / "log.parquet")
        return folder / "log.parquet"

    return make


def mat5(variables: dict[str, object]) -> Maker:
    def make(folder: Path) -> Path:
        from scipy.io import savemat

        savemat(folder / "log.mat", variables)
        return folder / "log.mat"

    return make


def hdf5(arrays: dict[str, np.ndarray], units: dict[str, str], name: str = "log.h5", *, matlab: bool = False) -> Maker:
    """An HDF5 file; as MATLAB 7.3 writes it, with its 512 bytes before, and every array by columns."""

    def make(folder: Path) -> Path:
        import h5py

        with h5py.File(folder / name, "w", userblock_size=512 if matlab else 0) as file:
            for key, values in arrays.items():
                made = file.create_dataset(key, data=np.atleast_2d(values.T) if matlab else values)
                if key in units:
                    made.attrs["units"] = units[key]
        if matlab:
            with (folder / name).open("r+b") as file:
                file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
        return folder / name

    return make
