"""PX4 ULog files as a table: the raw readings of one gyro, by pyulog.

Topics and units: PX4 message definitions (sensor_gyro: rad/s, deg C; sensor_accel: m/s2; vehicle_imu: delta_angle, rad,
in delta_angle_dt, us; sensor_combined: gyro_rad rad/s). Time stamps are us since boot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labctl.errors import BadInput, BadRecording
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.importer import TableImporter, TableOptions
from labctl.recording.logs.recognition import MAX_LOG_BYTES, head_of, refuse_large
from labctl.recording.raw_table import RawColumn, RawTable
from labctl.recording.unread import Unread, refuse_unread

# The messages of a damaged ULog: which bytes are sound, found again after each damage, without a library.
#
# A message is its size (2 bytes), its type (1) and a body. Data of one subscription always have one size, and a reading
# follows its subscription, so that a place where several such messages follow each other is no chance.

#: Length of the header of the file, and of a message.
HEADER, MESSAGE = 16, 3
DATA, SUBSCRIPTION, FLAGS, SYNC = ord("D"), ord("A"), ord("B"), ord("S")
#: ULog format, "Message types".
KINDS = frozenset(b"FIMPQABRDLCSO")
SYNC_BODY = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
#: So many messages in a row show where a log goes on after damage.
IN_A_ROW = 4
#: What is searched for such a place, bytes; beyond it the rest is lost.
MAX_SEARCHED = 1 << 24
#: Bodies have at least so many bytes: number and time; instance, number and a name.
MIN_DATA, MIN_SUBSCRIPTION = 10, 4
#: A message of another kind than data is shorter than this, bytes.
LONGEST = 10_000


@dataclass
class _Walk:
    """Positions of the sound messages, and what the log has said so far."""

    content: bytes
    sizes: dict[int, int] = field(default_factory=dict)  #: subscription -> size of its data; 0: none seen yet
    last_us: int = 0

    def end_of(self, at: int) -> int:
        """Return where a message ends that may be sound; 0 where it is not."""
        content = self.content
        if at + MESSAGE >= len(content):
            return 0
        size, kind = content[at] | content[at + 1] << 8, content[at + 2]
        end = at + MESSAGE + size
        if size == 0 or end > len(content) or kind not in KINDS:
            return 0
        if kind == DATA:
            is_sound = size >= MIN_DATA and self.sizes.get(content[at + 3] | content[at + 4] << 8) in (0, size)
        elif kind == SYNC:
            is_sound = content[at + MESSAGE : end] == SYNC_BODY
        elif kind == SUBSCRIPTION:
            is_sound = size >= MIN_SUBSCRIPTION and content[at + MESSAGE + 3 : end].isascii()
        else:
            is_sound = size < LONGEST
        return end if is_sound else 0

    def take(self, at: int) -> None:
        """Take in a sound message."""
        content = self.content
        size, kind = content[at] | content[at + 1] << 8, content[at + 2]
        if kind == DATA:
            self.sizes[content[at + 3] | content[at + 4] << 8] = size
            self.last_us = int.from_bytes(content[at + 5 : at + 13], "little")
        elif kind == SUBSCRIPTION:
            self.sizes.setdefault(content[at + 4] | content[at + 5] << 8, 0)

    def goes_on(self, after: int) -> int:
        """Return the first place at or after one where messages follow each other again; the end without one."""
        end = len(self.content)
        for at in range(after, min(end, after + MAX_SEARCHED)):
            place = at
            for _ in range(IN_A_ROW):
                place = self.end_of(place)
                if place in (0, end):
                    break
            if place:
                return at
        return end


@dataclass(frozen=True)
class Gap:
    """Bytes of a log that are no messages, and the times about them, us since boot; None: no reading follows."""

    start: int
    end: int
    before_us: int
    after_us: int | None


def sound_bytes(content: bytes) -> tuple[bytes, Unread | None]:
    """Return the header and the sound messages of a log, and what is none; itself, and None, where all is sound.

    The message before a gap is left out where it holds data: its end may be damaged too.
    """
    sound_parts, gaps = list[tuple[int, int]](), list[Gap]()
    for start, end, gap in _runs(content):
        sound_parts.append((start, end))
        if gap is not None:
            gaps.append(gap)
    if not gaps:
        return content, None
    body = b"".join(content[start:end] for start, end in sound_parts)
    size = int.from_bytes(body[:2], "little")
    if body[2:3] == bytes([FLAGS]):  # the places of appended data that it states are others now
        body = body[MESSAGE + size :]
    lost_bytes = sum(gap.end - gap.start for gap in gaps)
    cut = gaps[-1].end == len(content)
    return content[:HEADER] + body, Unread(lost_bytes / len(content), tuple(map(_said, gaps)), is_cut=cut)


def _runs(content: bytes) -> Iterator[tuple[int, int, Gap | None]]:
    """Yield the stretches of sound messages, (first byte, end), each with the gap that follows it."""
    walk, start, at, last = _Walk(content), HEADER, HEADER, -1
    while at < len(content):
        end = walk.end_of(at)
        if end:
            before_us, last = walk.last_us, at
            walk.take(at)
            at = end
            continue
        if last >= start and content[last + 2] == DATA:
            at, walk.last_us = last, before_us
        next_at = walk.goes_on(at + 1 if at != last else at + MESSAGE)
        gap = Gap(at, next_at, walk.last_us, None)
        if next_at < len(content):
            walk.take(next_at)
            gap = Gap(at, next_at, gap.before_us, walk.last_us)
        yield start, at, gap
        start = at = next_at
        last = -1
    if at > start:
        yield start, at, None


def _said(gap: Gap) -> str:
    until = "to the end" if gap.after_us is None else f"to {gap.after_us / 1e6:.3f} s"
    return f"bytes {gap.start} to {gap.end} ({gap.before_us / 1e6:.3f} s {until} of its clock)"


#: ULog format, "File header": the first seven bytes of every log.
MAGIC = b"ULog\x01\x12\x35"
GYRO, COMBINED, INTEGRATED, ACCEL = "sensor_gyro", "sensor_combined", "vehicle_imu", "sensor_accel"
#: Topics with the output of a gyro, the rawest first.
TOPICS = (GYRO, INTEGRATED, COMBINED)
#: Topics with the time of day; a receiver without a fix sends 0. Nothing was logged before 2001, us.
RECEIVERS, EARLIEST_US = ("vehicle_gps_position", "sensor_gps"), 1e15
#: The length of a message is a number of 16 bits, and no value is smaller than a byte; types in types go this deep.
MAX_VALUES, MAX_NESTED = 0xFFFF, 16
#: Readings of an accelerometer this far apart in time belong to no reading of the gyro, s.
MAX_APART_S = 0.5

Array = NDArray[np.float64]


class ULogOptions(TableOptions):
    """Which of a log's gyros to take."""

    topic: Literal["sensor_gyro", "vehicle_imu", "sensor_combined"] | None = None  #: None: the rawest that is there
    instance: int = Field(default=0, ge=0, le=255)  #: which of several gyros, from 0


def probe(path: Path) -> float:
    """Return 1 for a file that begins as ULog files do."""
    if not path.is_file():
        return 0.0
    with path.open("rb") as file:
        return float(file.read(len(MAGIC)) == MAGIC)


def read(path: Path, options: ULogOptions) -> RawTable:
    """Return time, output, temperature and specific force of one gyro; raises BadRecording, BadInput."""
    head_of(path)
    refuse_large(path, MAX_LOG_BYTES)
    with parsed_by_library(path, "ULog file", "take the log off the card again"):
        return _read(path, options)  # damaged names and types of fields show here, not in the parser


def _read(path: Path, options: ULogOptions) -> RawTable:
    log, unread = _parsed(path)
    data = {(each.name, each.multi_id): each.data for each in log.data_list}
    topics = sorted(key for key in data if key[0] in TOPICS)
    rawest = next((topic for topic in TOPICS if any(name == topic for name, _ in topics)), None)
    topic: str | None = options.topic or rawest
    listed = ", ".join(f"{name} {instance}" for name, instance in topics)
    if topic is None:
        names = ", ".join(sorted({name for name, _ in data})[:12])
        raise BadRecording(
            f"{path}: the log has none of the topics {', '.join(TOPICS)} (it has {names or 'no topic'}); log "
            "one of them "
            "(SDLOG_PROFILE: sensor comparison, or high rate), or take another log"
        )
    if (topic, options.instance) not in data:
        raise BadInput(
            f"{path}: {topic} has no instance {options.instance} (instances: {listed}); choose one with "
            "--option instance=N, and --option topic=NAME"
        )
    columns = _gyro(path, topic, data[topic, options.instance])
    instance = options.instance if topic != COMBINED else 0
    _add_temperature(columns, data, instance)
    _add_force(columns, data, instance)
    return _table(path, log, f"{topic} {options.instance} (of {listed})", columns, _booted(data), unread)


def _parsed(path: Path) -> tuple[Any, Unread | None]:
    """Return the log of the sound messages of a file, and what could not be read of it. Raises BadRecording."""
    from pyulog.core import ULog  # noqa: PLC0415  0.1 s that only logs need

    class BoundedLog(ULog):  # type: ignore[misc]  # pyulog has no types
        """A log whose types are examined before pyulog writes out each of their values."""

        class _MessageAddLogged(ULog._MessageAddLogged):  # type: ignore[misc]  # noqa: SLF001  pyulog's name
            def _parse_format(self, formats: Mapping[str, Any]) -> None:
                _values_of(path, self.message_name, formats)
                super()._parse_format(formats)

    content, unread = sound_bytes(path.read_bytes())
    refuse_unread(path, unread)
    with redirect_stdout(StringIO()):  # it prints what it finds damaged
        return BoundedLog(BytesIO(content), [*TOPICS, *RECEIVERS, ACCEL]), unread


def _values_of(path: Path, kind: str, formats: Mapping[str, Any], within: tuple[str, ...] = ()) -> int:
    """Return how many values a message of a type holds. Raises BadRecording for more than a message has bytes."""
    if kind in within or len(within) > MAX_NESTED:
        raise BadRecording(f"{path}: the type {kind} of the log contains itself; take the log off the card again")
    values = 0
    for field_kind, count, _ in formats[kind].fields:
        of_one = _values_of(path, field_kind, formats, (*within, kind)) if field_kind in formats else 1
        values += max(count, 1) * of_one
        if values > MAX_VALUES:
            raise BadRecording(
                f"{path}: a message of type {kind} would hold more than {MAX_VALUES} values, the limit of a ULog "
                "message; take the log off the card again"
            )
    return max(values, 1)


def _gyro(path: Path, topic: str, data: Mapping[str, Any]) -> dict[str, Array]:
    try:
        stamps = np.asarray(data.get("timestamp_sample", data["timestamp"]), dtype=np.float64)
        if not stamps.any():
            stamps = np.asarray(data["timestamp"], dtype=np.float64)
        if topic == GYRO:
            rates = [data[axis] for axis in "xyz"]
        elif topic == COMBINED:
            stamps = np.asarray(data["timestamp"], dtype=np.float64)
            rates = [data[f"gyro_rad[{index}]"] for index in range(3)]
        else:
            dt_s = 1e-6 * np.asarray(data["delta_angle_dt"], dtype=np.float64)
            dt_s = np.where(dt_s > 0, dt_s, np.nan)
            rates = [np.asarray(data[f"delta_angle[{index}]"], dtype=np.float64) / dt_s for index in range(3)]
    except KeyError as error:
        raise BadRecording(
            f"{path}: {topic} has no field {error}; choose another topic with --option topic=NAME"
        ) from error
    if not len(stamps):
        raise BadRecording(f"{path}: {topic} holds no reading; take another log, or another topic")
    columns = {"timestamp": stamps}
    columns.update(
        {f"gyro_{axis}": np.asarray(rate, dtype=np.float64) for axis, rate in zip("xyz", rates, strict=True)}
    )
    if topic == GYRO and "temperature" in data:
        columns["temperature"] = np.asarray(data["temperature"], dtype=np.float64)
    if topic == COMBINED and "accelerometer_m_s2[0]" in data:
        force = {f"accel_{axis}": data[f"accelerometer_m_s2[{index}]"] for index, axis in enumerate("xyz")}
        columns.update({name: np.asarray(values, dtype=np.float64) for name, values in force.items()})
    return columns


def _add_temperature(columns: dict[str, Array], data: Mapping[tuple[str, int], Any], instance: int) -> None:
    """Fill in the gyro's own thermometer, which PX4 logs with sensor_gyro only, at the times of the readings."""
    source = data.get((GYRO, instance))
    if "temperature" not in columns and source is not None and "temperature" in source:
        columns["temperature"] = _at(columns["timestamp"], source, "temperature")
    if "temperature" in columns and not np.isfinite(columns["temperature"]).all():
        del columns["temperature"]


def _add_force(columns: dict[str, Array], data: Mapping[tuple[str, int], Any], instance: int) -> None:
    source = data.get((ACCEL, instance))
    if source is None or "accel_x" in columns or any(axis not in source for axis in "xyz"):
        return
    stamps = np.asarray(source["timestamp"], dtype=np.float64)
    if not len(stamps):
        return
    nearest = np.abs(np.interp(columns["timestamp"], stamps, stamps) - columns["timestamp"])
    if nearest.max() > 1e6 * MAX_APART_S:
        return
    for axis in "xyz":
        columns[f"accel_{axis}"] = _at(columns["timestamp"], source, axis)


def _at(times: Array, source: Mapping[str, Any], name: str) -> Array:
    stamps = np.asarray(source.get("timestamp_sample", source["timestamp"]), dtype=np.float64)
    return np.interp(times, stamps, np.asarray(source[name], dtype=np.float64))


_TARGETS = {
    "timestamp": ("t_s", "us"), "gyro_x": ("gyro_x", "rad/s"), "gyro_y": ("gyro_y", "rad/s"),
    "gyro_z": ("gyro_z", "rad/s"), "temperature": ("temperature_c", "deg C"), "accel_x": ("accel_x_g", "m/s2"),
    "accel_y": ("accel_y_g", "m/s2"), "accel_z": ("accel_z_g", "m/s2"),
}  # fmt: skip


def _table(
    path: Path, log: Any, message_name: str, columns: dict[str, Array], started: datetime | None, unread: Unread | None
) -> RawTable:
    damaged = "; damaged in places, which are left out" if log.file_corruption or unread else ""
    facts: dict[str, object] = {"notes": f"PX4 ULog, {message_name}{damaged}"}
    uid = log.msg_info_dict.get("sys_uuid", "")
    if isinstance(uid, str) and uid.isalnum() and uid.isascii():
        facts["serial"] = f"{uid[-16:]}-{message_name.split(' ')[1]}"
    raw = {name: RawColumn(name, values, unit=_TARGETS[name][1]) for name, values in columns.items()}
    targets = {name: _TARGETS[name][0] for name in raw}
    return RawTable(
        path, raw, len(columns["timestamp"]), targets=targets, facts=facts, started_at=started, unread=unread
    )


def _booted(data: Mapping[tuple[str, int], Any]) -> datetime | None:
    """Return when the log's clock was 0, from the first fix of a satellite receiver; None without one."""
    for topic in RECEIVERS:
        source = data.get((topic, 0))
        if source is None or "time_utc_usec" not in source:
            continue
        utc_us = np.asarray(source["time_utc_usec"], dtype=np.float64)
        synchronised = np.flatnonzero(utc_us > EARLIEST_US)
        if len(synchronised):
            boot_us = float(utc_us[synchronised[0]]) - float(source["timestamp"][synchronised[0]])
            with suppress(OverflowError, ValueError):
                return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=boot_us)
    return None


IMPORTER = TableImporter("a PX4 ULog", probe, read, ULogOptions)
