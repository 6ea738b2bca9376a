"""What a file is by its first bytes, so that one that holds no readings is refused with its name."""

from __future__ import annotations

import stat
from pathlib import Path

from labctl.errors import BadRecording

#: The largest text file that is read: about ten bytes for each value that an import takes.
MAX_TEXT_BYTES = 1_000_000_000
#: A binary log is held in memory whole by its reader.
MAX_LOG_BYTES = 1_000_000_000
HEAD_BYTES = 1 << 16

#: R's own command, which any installation of R has.
AS_CSV_BY_R = (
    'write it as CSV: Rscript -e \'n <- load("FILE.rda"); write.csv(as.data.frame(get(n[1])), "FILE.csv", '
    "row.names=FALSE)'"
)
RDS_AS_CSV_BY_R = (
    'write it as CSV: Rscript -e \'write.csv(as.data.frame(readRDS("FILE.rds")), "FILE.csv", row.names=FALSE)\''
)
#: First bytes -> what begins so, and what to do with it.
_SIGNATURES: tuple[tuple[bytes, str, str], ...] = (
    *((begin, "R data", AS_CSV_BY_R) for begin in (b"RDX2\n", b"RDX3\n", b"RDA2\n", b"RDA3\n")),
    *((begin, "an R object (.rds)", RDS_AS_CSV_BY_R) for begin in (b"X\n\x00\x00\x00", b"A\n2\n", b"A\n3\n")),
    (b"PK\x03\x04", "a zip archive or a spreadsheet", "unpack it and import the log itself, or save the sheet as CSV"),
    (b"PK\x05\x06", "an empty zip archive", "import the log itself"),
    (b"\x1f\x8b", "packed with gzip", "unpack it with gunzip and import the log itself"),
    (b"BZh", "packed with bzip2", "unpack it with bunzip2 and import the log itself"),
    (b"\xfd7zXZ\x00", "packed with xz", "unpack it with unxz and import the log itself"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it and import the log itself"),
    (b"Rar!", "a rar archive", "unpack it and import the log itself"),
    (b"\x28\xb5\x2f\xfd", "packed with zstd", "unpack it with unzstd and import the log itself"),
    (b"%PDF", "a PDF document", "import the log itself, as text"),
    (b"\x89PNG", "a picture", "import the log itself"),
    (b"\xff\xd8\xff", "a picture", "import the log itself"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet", "save the sheet as CSV"),
    (b"MATLAB 5.0", "a MATLAB file", "write it as CSV with writematrix"),
    (b"\x89HDF", "an HDF5 or MATLAB file", "write it as CSV or Parquet"),
    (b"SQLite format 3", "an SQLite database", "for a ROS 2 bag name its folder; else write a table of it as CSV"),
    (b"\x7fELF", "a program", "import the log itself"),
    (b"\x93NUMPY", "a numpy array", "write it as CSV with numpy.savetxt"),
    (b"{", "JSON", "write its readings as CSV, one row each"),
    (b"<", "XML or HTML", "write its readings as CSV, one row each"),
    (b"\xa3\x95", "an ArduPilot DataFlash log", "convert it to CSV with mavlogdump.py --format csv --types IMU"),
)


def head_of(path: Path) -> bytes:
    """Return the first bytes of a file; raises BadRecording where there are none, or it is no plain file."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise BadRecording(f"{path}: not a plain file; name the file that holds the readings")
        if status.st_size == 0:
            raise BadRecording(f"{path}: the file is empty; expected readings of a gyro")
        with path.open("rb") as file:
            return file.read(HEAD_BYTES)
    except OSError as error:
        raise BadRecording(f"{path}: {error.strerror or error}; name a file that can be read") from error


def refuse_other(path: Path, head: bytes) -> None:
    """Raise BadRecording for a file that is known to hold no readings as they are."""
    for signature, kind, advice in _SIGNATURES:
        if head.startswith(signature):
            raise BadRecording(f"{path}: this is {kind}, which labctl cannot read as it is; {advice}")


def refuse_large(path: Path, most_bytes: int) -> None:
    """Raise BadRecording for a file of more bytes than are read."""
    size = path.stat().st_size
    if size > most_bytes:
        raise BadRecording(
            f"{path}: {size / 1e6:.0f} MB; at most {most_bytes / 1e6:.0f} MB of such a file are read; divide it"
        )
