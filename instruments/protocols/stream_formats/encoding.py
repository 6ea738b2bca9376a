"""Lines and frames of a format from whole numbers: what a simulated device sends."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from instruments.protocols.stream_formats.checksums import algorithm
from instruments.protocols.stream_formats.document import (
    BytesField,
    FrameLayout,
    LengthField,
    LineLayout,
    StreamFormat,
    hex_bytes,
)
from instruments.protocols.stream_formats.readings import step_of

_CODES = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "f32": "f", "f64": "d"}


def message(format_: StreamFormat, numbers: Mapping[str, int]) -> bytes:
    """Return the line, with CR LF, or the frame of one reading; a field that is not given is 0."""
    if format_.line is not None:
        return line_of(format_.line, numbers)
    assert format_.frame is not None
    return frame_of(format_.frame, numbers)


def line_of(layout: LineLayout, numbers: Mapping[str, int]) -> bytes:
    """Return a line with CR LF."""
    last = max(field.column for field in layout.fields)
    words = ["0"] * (last + 1 if layout.columns is None else layout.columns)
    if layout.begins:
        words[0] = layout.begins.rstrip(layout.separator)
    for field in layout.fields:
        step = step_of(field)
        places = max(0, len(f"{step:.15f}".rstrip("0").partition(".")[2]))
        number = f"{numbers.get(field.name, 0) * step:+.{places}f}"
        words[field.column] = field.prefix + number.removeprefix("+") if field.prefix else number
    body = layout.separator.join(words)
    if layout.checksum is not None:
        used = algorithm(layout.checksum.algorithm)
        sum_ = used.of(body.encode("ascii")[layout.checksum.start :])
        body += f"{layout.checksum.mark}{sum_:0{2 * used.size}X}"
    return body.encode("ascii") + b"\r\n"


def frame_of(layout: FrameLayout, numbers: Mapping[str, int]) -> bytes:
    """Return a frame, with its checksum; of items those that have fields."""
    frame = bytearray(hex_bytes(layout.sync))
    data_at = _add_items(frame, layout)
    end = max(field.at + field.size for field in layout.fields if field.item is None) if layout.items is None else 0
    if isinstance(layout.length, int):
        end = layout.content_end(layout.length)
    frame += bytes(max(0, end - len(frame)))
    for field in layout.fields:
        at = data_at[field.item] + field.at
        value = numbers.get(field.name, 0)
        order = field.byte_order or layout.byte_order
        frame[at : at + field.size] = _packed(field, value, order)
    checksum = layout.checksum
    size = 0 if checksum is None else algorithm(checksum.algorithm).size
    if isinstance(layout.length, LengthField):
        length = layout.length
        whole = len(frame) + size + len(hex_bytes(layout.trailer))
        width = 1 if length.type == "u8" else 2
        frame[length.at : length.at + width] = (whole - length.plus).to_bytes(width, layout.byte_order)
    if checksum is not None:
        sum_ = algorithm(checksum.algorithm).of(bytes(frame[checksum.start :]))
        frame += sum_.to_bytes(size, checksum.byte_order or layout.byte_order)
    return bytes(frame) + hex_bytes(layout.trailer)


def _add_items(frame: bytearray, layout: FrameLayout) -> dict[int | None, int]:
    """Append the heads and empty data of the items that fields name; return the offset of the data of each.

    What belongs to no item counts from the beginning of the frame.
    """
    items = layout.items
    data_at: dict[int | None, int] = {None: 0}
    if items is None:
        return data_at
    frame += bytes(items.at - len(frame))
    for item in dict.fromkeys(field.item for field in layout.fields if field.item is not None):
        size = max(field.at + field.size for field in layout.fields if field.item == item)
        frame += item.to_bytes(int(items.id_type[1:]) // 8, layout.byte_order)
        frame += size.to_bytes(int(items.size_type[1:]) // 8, layout.byte_order)
        data_at[item] = len(frame)
        frame += bytes(size)
    return data_at


def _packed(field: BytesField, value: int, order: str) -> bytes:
    if field.size == 3:
        return (value & 0xFFFFFF).to_bytes(3, "big" if order == "big" else "little")
    sign = ">" if order == "big" else "<"
    if field.is_float:
        return struct.pack(sign + _CODES[field.type], value * step_of(field))
    bits = 8 * field.size
    low, high = (0, (1 << bits) - 1) if field.type.startswith("u") else (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    return struct.pack(sign + _CODES[field.type], min(max(value, low), high))
