"""Whole files that say much about few bytes, or hold what no log holds: each is imported, or refused by its name."""

from __future__ import annotations

import bz2
import io
import sqlite3
import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from uuid import uuid4

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from studies.damaged_logs import (
    CSV_MAP,
    RECORDING,
    DamagedLog,
    parquet_of,
    ros1,
    ros2,
    rows,
)

MIB = 1 << 20
#: What a packed chunk unpacks to: more than an import may take.
BOMB_MIB = 6144
NAMES = ("time [s]", "gyro_x [rad/s]", "gyro_y [rad/s]", "gyro_z [rad/s]", "temp [degC]")


def _zeros() -> bytes:
    """Return 64 MiB; made when asked for, as all that is large here: tests import this and use little of it."""
    return bytes(64 * MIB)


def _bz2_bomb(content: bytes) -> bytes:
    return bz2.compress(content) + (BOMB_MIB // 64) * bz2.compress(_zeros())


def _lz4_bomb(content: bytes) -> bytes:
    from lz4.frame import LZ4FrameCompressor

    packer = LZ4FrameCompressor()
    parts = [packer.begin(), packer.compress(content)]
    zeros = _zeros()
    parts += [packer.compress(zeros) for _ in range(BOMB_MIB // 64)]
    return b"".join([*parts, packer.flush()])


def _zstd_bomb(content: bytes) -> bytes:
    from backports import zstd

    packer = zstd.ZstdCompressor()
    zeros = _zeros()
    parts = [packer.compress(content)] + [packer.compress(zeros) for _ in range(BOMB_MIB // 64)]
    return b"".join([*parts, packer.flush()])


def _endless_view(folder: Path) -> bytes:
    """Return a bag whose table of types is a view that never ends."""
    path = folder / f"{uuid4().hex}.db3"
    path.write_bytes(ros2("SQLITE3")(folder))
    raw = sqlite3.connect(path)
    raw.execute("ALTER TABLE message_definitions RENAME TO few")
    raw.execute(
        "CREATE VIEW message_definitions AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
        "SELECT few.*, i AS id FROM n, few"
    )
    raw.commit()
    raw.close()
    return path.read_bytes()


def _ulog(fields: bytes, *formats: bytes, message: bytes = b"") -> Callable[[Path], bytes]:
    """Return what writes a log of one message of sensor_gyro with these fields; `formats` are further types."""

    def packet(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    def written(_: Path) -> bytes:
        head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
        types = (b"sensor_gyro:uint64_t timestamp;" + fields, *formats)
        added = packet("A", struct.pack("<BH", 0, 0) + b"sensor_gyro")
        return head + b"".join(packet("F", each) for each in types) + added + packet("D", message)

    return written


#: Types of 1024 values of the next type each.
NESTED = tuple(f"a{n}:a{n + 1}[1024] x;".encode() for n in range(6))


def _columns(**changed: object) -> dict[str, object]:
    named = dict(zip(NAMES, rows().T, strict=True))
    return named | {NAMES["txyzw".index(name)]: values for name, values in changed.items()}


def _table(values: Callable[[], object], **options: object) -> Callable[[Path], bytes]:
    """Return what writes a Parquet file whose column gyro_x holds other values."""
    return lambda _: parquet_of(_columns(x=values()), **options)


def _named_twice(_: Path) -> bytes:
    made = io.BytesIO()
    t_s, x, y, _z, _warm = rows().T
    pq.write_table(pa.table([t_s, x, y, x], names=[NAMES[0], NAMES[1], NAMES[1], NAMES[3]]), made)
    return made.getvalue()


N = len(rows())
PARQUET: Mapping[str, Callable[[Path], bytes]] = {
    "structs": _table(lambda: pa.array([{"a": 1.0, "b": {"c": 2}}] * N)),
    "lists": _table(lambda: pa.array([[1.0, 2.0]] * N)),
    "maps": _table(lambda: pa.array([[("a", 1.0)]] * N, pa.map_(pa.string(), pa.float64()))),
    "true and false": _table(lambda: pa.array([True, False] * (N // 2))),
    "a dictionary of words": _table(lambda: pa.array(["a", "b"] * (N // 2)).dictionary_encode()),
    "a dictionary of numbers": _table(lambda: pa.array([1.0, 2.0] * (N // 2)).dictionary_encode()),
    "nulls only": _table(lambda: pa.nulls(N, pa.float64())),
    "nulls of no type": _table(lambda: pa.nulls(N)),
    "nulls between": _table(lambda: pa.array([1.0, None] * (N // 2))),
    "decimals": _table(lambda: pa.array(np.arange(N)).cast(pa.decimal128(38, 2))),
    "times": _table(lambda: pa.array(np.arange(N)).cast(pa.timestamp("ns"))),
    "bytes": _table(lambda: pa.array([b"\xff\x00"] * N)),
    "half precision": _table(lambda: pa.array(np.arange(N).astype(np.float16))),
    "largest unsigned": _table(lambda: pa.array(np.full(N, 2**64 - 1, dtype=np.uint64))),
    "infinities": _table(lambda: np.where(np.arange(N) % 2, np.inf, np.nan)),
    "long words": _table(lambda: pa.array(["x" * 200_000] * N), compression="zstd", use_dictionary=False),
    "one column twice": _named_twice,
    "no row": lambda _: parquet_of({name: pa.array([], pa.float64()) for name in NAMES}),
    "no column": lambda _: parquet_of({}),
    "10000 columns": lambda _: parquet_of({f"c{n}": [1.0] for n in range(10_000)}),
    "names of other scripts": lambda _: parquet_of({"\u202etime": [1.0], "\x00": [1.0], "a\nb": [1.0], "": [1.0]}),
    "100 million constant rows": lambda _: parquet_of({NAMES[0]: np.zeros(10**8), NAMES[1]: np.zeros(10**8)}),
}


def _texts() -> Mapping[str, bytes]:
    return {
        "nothing": b"", "one line": b"a", "a line of 8 MB": b"t;" + b"x" * 8_000_000 + b"\n1;2\n", "zeros": bytes(MIB),
        "200000 columns": b";".join([b"t"] * 200_000) + b"\n" + b";".join([b"1"] * 200_000),
        "a quote that never ends": b'time;x;y;z;temp\n"1;2;3;4;5\n' * 1000,
        "names twice": b"unit\ntime;x;x;x;x\n1;2;3;4;5\n2;2;3;4;5\n",
        "rows of other lengths": b"u\ntime;x;y;z;temp\n1;2\n1;2;3;4;5;6\n",
        "UTF-16": "unit\ntime;x;y;z;temp\n1;2;3;4;5\n".encode("utf-16"),
        "huge figures": b"u\ntime;x;y;z;temp\n1e308;1e999;nan;inf;-0\n" * 9,
    }  # fmt: skip


TOML: Mapping[str, bytes] = {
    "deep lists": b"axes = " + b"[" * 20_000, "deep names": b"a" + b".a" * 20_000 + b" = 1",
    "a long integer": b"latitude_deg = " + b"9" * 10_000, "1e999": b"sample_rate_hz = 1e999",
    "a table for a text": b"serial = {a = 1}", "100000 axes": b"axes = [" + b'"x",' * 100_000 + b"]",
    "a NUL": b'serial = "a\\u0000b"', "a text of 2 MB": b'notes = "' + b"x" * 2 * MIB + b'"',
    "year 1": b"started_at = 0001-01-01T00:00:00+14:00", "negative rate": b"sample_rate_hz = -1.0",
    "rate 0": b"sample_rate_hz = 0", "scale 0": b"[output.z]\ngain = 0", "scale nan": b"[output.z]\nsign = nan",
}  # fmt: skip
#: Only a limit of memory or time ends these.
BOMBS: Mapping[str, tuple[str, Callable[[Path], bytes]]] = {
    "ROS 1 bag, a chunk of bz2 that unpacks to 6 GiB": ("log.bag", ros1("bz2", _bz2_bomb)),
    "ROS 1 bag, a chunk of lz4 that unpacks to 6 GiB": ("log.bag", ros1("lz4", _lz4_bomb)),
    "MCAP, a chunk of zstd that unpacks to 6 GiB": ("log.mcap", ros2("MCAP", packed=True, packing=_zstd_bomb)),
    "SQLite, types without end": ("log.db3", _endless_view),
}
LOGS: Mapping[str, tuple[str, Callable[[Path], bytes]]] = {
    "ULog, 4294967295 values in a message": ("log.ulg", _ulog(b"float[4294967295] x;")),
    "ULog, a field of its own type": ("log.ulg", _ulog(b"sensor_gyro x;")),
    "ULog, a type in itself by another": ("log.ulg", _ulog(b"a x;", b"a:sensor_gyro y;")),
    "ULog, a field twice": ("log.ulg", _ulog(b"float x;float x;float y;float z;", message=bytes(30))),
    "ULog, 2 ** 60 values by nesting": ("log.ulg", _ulog(b"a0[1024] x;", *NESTED, b"a6:float x;")),
}  # fmt: skip


def hostile_logs(folder: Path, kinds: Collection[str] = ()) -> Iterator[DamagedLog]:
    """Yield each of these files of some kinds, default all; `folder` is for what is written on the way."""
    for kind in kinds or KINDS:
        yield from KINDS[kind](folder)


def _logs(folder: Path) -> Iterator[DamagedLog]:
    for said, (name, write) in LOGS.items():
        yield DamagedLog("crafted log", name, said, write(folder))


def _bombs(folder: Path) -> Iterator[DamagedLog]:
    for said, (name, write) in BOMBS.items():
        yield DamagedLog("bomb", name, said, write(folder))


def _parquet(folder: Path) -> Iterator[DamagedLog]:
    for said, make in PARQUET.items():
        yield DamagedLog("crafted Parquet", "log.parquet", said, make(folder))


def _csv(_: Path) -> Iterator[DamagedLog]:
    for said, text in _texts().items():
        yield DamagedLog("crafted CSV", "log.csv", said, text, CSV_MAP)
        yield DamagedLog("crafted CSV", "log.csv", f"{said}, without a map", text)


def _recordings(folder: Path) -> Iterator[DamagedLog]:
    whole = {name: write(folder) for name, write in RECORDING.items()}
    head = whole["recording.toml"]
    for said, line in TOML.items():
        key = line.partition(b" =")[0]
        kept = b"\n".join(each for each in head.split(b"\n") if not each.startswith(key + b" "))
        content = kept.replace(b"[output.z]\n", line + b"\n") if line.startswith(b"[") else line + b"\n" + kept
        yield DamagedLog("crafted recording", "recording.toml", said, content, beside=whole)


def _maps(_: Path) -> Iterator[DamagedLog]:
    for said, text in TOML.items():
        yield DamagedLog("crafted map", "log.csv", said, b"t;x\n1;2\n", text.decode())


#: Kind -> what yields its files.
KINDS: Mapping[str, Callable[[Path], Iterator[DamagedLog]]] = {
    "crafted log": _logs,
    "crafted Parquet": _parquet,
    "crafted CSV": _csv,
    "crafted recording": _recordings,
    "crafted map": _maps,
    "bomb": _bombs,
}
