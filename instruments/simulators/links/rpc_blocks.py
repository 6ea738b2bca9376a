"""Calls of gRPC and their replies as bytes: the parts that HTTP/2 carries, one after the other, without its frames.

A call is its path as a header, an empty line, and the message; a reply is the message, where there is one, and the
trailing metadata with the status, ended by an empty line. A message has gRPC's own prefix: a byte for "not compressed",
and its length.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from urllib.parse import quote, unquote

PREFIX = struct.Struct(">BI")
END = b"\r\n\r\n"
PATH, STATUS, DETAILS = ":path", "grpc-status", "grpc-message"


@dataclass(frozen=True)
class Call:
    """A call: path, as `/service/method`, and message."""

    path: str
    message: bytes


@dataclass(frozen=True)
class Reply:
    """A reply: the message, or why there is none, with the metadata behind it."""

    message: bytes | None
    status: int = 0
    details: str = ""
    metadata: tuple[tuple[str, str], ...] = ()


def call_block(call: Call) -> bytes:
    """Return the bytes of a call."""
    return _headers((PATH, call.path)) + PREFIX.pack(0, len(call.message)) + call.message


def reply_block(reply: Reply) -> bytes:
    """Return the bytes of a reply."""
    message = b"" if reply.message is None else PREFIX.pack(0, len(reply.message)) + reply.message
    details = quote(reply.details, safe=" !\"#$&'()*+,-./:;<=>?@[]^_`{|}~")
    return message + _headers((STATUS, str(reply.status)), (DETAILS, details), *reply.metadata)


def take_call(data: bytes) -> tuple[Call, bytes] | None:
    """Return the first call and the bytes behind it; None while it is not whole. Raises ValueError for no call."""
    if (end := data.find(END)) < 0:
        return None
    headers, rest = _pairs(data[:end]), data[end + len(END) :]
    if PATH not in headers:
        raise ValueError("a call has no path")
    if len(rest) < PREFIX.size or len(rest) < (size := PREFIX.size + PREFIX.unpack_from(rest)[1]):
        return None
    return Call(headers[PATH], rest[PREFIX.size : size]), rest[size:]


def take_reply(data: bytes) -> Reply | None:
    """Return a reply, of which nothing may be left; None while it is not whole. Raises ValueError for no reply."""
    message: bytes | None = None
    if data[:1] == b"\0":
        if len(data) < PREFIX.size or len(data) < (size := PREFIX.size + PREFIX.unpack_from(data)[1]):
            return None
        message, data = data[PREFIX.size : size], data[size:]
    if (end := data.find(END)) < 0:
        return None
    trailers = _pairs(data[:end])
    if end + len(END) != len(data) or STATUS not in trailers:
        raise ValueError("the status of a reply is not where it must be")
    status, details = int(trailers.pop(STATUS)), unquote(trailers.pop(DETAILS, ""))
    return Reply(message, status, details, tuple(trailers.items()))


def _headers(*pairs: tuple[str, str]) -> bytes:
    return "".join(f"{key}: {value}\r\n" for key, value in pairs).encode("ascii") + b"\r\n"


def _pairs(block: bytes) -> dict[str, str]:
    """Return headers by name; raises ValueError for a line that is none."""
    return dict(_pair(line) for line in block.decode("ascii").split("\r\n"))


def _pair(line: str) -> tuple[str, str]:
    key, colon, value = line.partition(": ")
    if not colon:
        raise ValueError(f"{line!r} is no header")
    return key, value
