"""How a call of gRPC ends: the numbers of its status."""

from __future__ import annotations

from enum import IntEnum


class RpcStatus(IntEnum):
    """Those that a client of a device meets."""

    OK = 0
    UNKNOWN = 2
    INVALID_ARGUMENT = 3
    DEADLINE_EXCEEDED = 4
    ALREADY_EXISTS = 6
    FAILED_PRECONDITION = 9
    UNIMPLEMENTED = 12
    INTERNAL = 13
    UNAVAILABLE = 14
