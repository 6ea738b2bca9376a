"""What the service tells systemd: that it is ready, that it lives, that it stops. Elsewhere, nothing."""

from __future__ import annotations

import os
import socket

#: Leaving the bench safe may take longer than the loop may stand still; systemd is notified when stopping begins.
STOPPING_US = 600_000_000


def tell(state: str) -> None:
    """Send one message to the service manager that started this process, if one did (sd_notify(3))."""
    address = os.environ.get("NOTIFY_SOCKET")
    if not address:
        return
    if address.startswith("@"):  # in the abstract namespace
        address = "\0" + address[1:]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as channel:
        try:
            channel.sendto(state.encode(), address)
        except OSError:
            return  # a manager that does not listen any more must not end a campaign


def ready() -> None:
    """Say that requests are answered from now on."""
    tell("READY=1")


def stopping() -> None:
    """Say that the end has begun, and that the watchdog shall wait for the bench to be safe."""
    tell(f"STOPPING=1\nWATCHDOG_USEC={STOPPING_US}")


def alive() -> None:
    """Say that the supervisor watches."""
    tell("WATCHDOG=1")


def period_s() -> int:
    """Return how often to say so: a third of what the service manager waits, in whole seconds."""
    watchdog_us = os.environ.get("WATCHDOG_USEC", "")
    return max(int(watchdog_us) // 3_000_000, 1) if watchdog_us.isdigit() else 30
