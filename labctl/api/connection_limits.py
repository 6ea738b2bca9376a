"""How many connections the service holds open, and how long each part of a request may take."""

from __future__ import annotations

import resource
from dataclasses import dataclass

KIB = 1 << 10
#: In the state of a request: whether its connection is one of the reserve.
RESERVED = "reserved"


@dataclass(frozen=True)
class ConnectionLimits:
    """Bounds on connections, which hold before a key is shown."""

    header_bytes: int = 64 * KIB  #: request line and headers together; trailers of a body, too
    headers: int = 128
    pipelined: int = 8  #: requests sent before the first of them is answered
    header_s: float = 10.0  #: from the connection, or the first byte of a further request, to the end of the headers
    stalled_s: float = 30.0  #: a body of which nothing comes, an answer of which nothing is taken off
    idle_s: int = 5  #: a kept connection without a request
    refused_s: float = 2.0  #: what a refused client still sends is read this long, so that it sees the answer
    refused_bytes: int = 1024 * KIB  #: and no more than this
    look_s: float = 1.0  #: how often times are compared
    total: int = 512
    local: int = 256  #: from this machine: all its users and a reverse proxy
    per_address: int = 64  #: from any other; an IPv6 network of 64 bits counts as one
    reserve: int = 32  #: above `total`, for `/health` and for operators who act
    backlog: int = 256  #: connections that the system holds until they are accepted


def limits_for(open_files: int) -> ConnectionLimits:
    """Return the limits of a process that may open so many files.

    Half of them at most are connections. Never more than 512, however many files there may be: pyserial waits for a
    port by select(2), which knows file numbers below 1,024 only.
    """
    usual = ConnectionLimits()
    total = max(min(usual.total, open_files // 2), 8)
    share = total / usual.total
    return ConnectionLimits(
        total=total,
        local=max(round(usual.local * share), 4),
        per_address=max(min(usual.per_address, total // 4), 2),
        reserve=max(round(usual.reserve * share), 4),
        backlog=max(round(usual.backlog * share), 4),
    )


def raise_open_files() -> int:
    """Let this process open as many files as its service manager allows; returns how many."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == hard:
        return soft
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    except (OSError, ValueError):  # "unlimited" can be more than the system can do
        return soft
    return hard
