"""Why a serial port cannot be opened, and the command that corrects it."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path

from instruments.protocols.can.address import is_can_address
from instruments.transport import can_port

#: Folders in which Linux names serial ports by their USB adapters, and by the sockets that these are plugged into.
BY_ID, BY_PATH = Path("/dev/serial/by-id"), Path("/dev/serial/by-path")
PROCESSES = Path("/proc")
#: Where Linux keeps the ends of pseudo-terminals that others open.
PSEUDO_TERMINALS = "/dev/pts/"
#: The end of a pseudo-terminal that its maker keeps.
MASTERS = frozenset({"/dev/ptmx", "/dev/pts/ptmx"})
#: A host, or the address of a port of it, that is this computer.
LOOPBACK = re.compile(r"(\w+://)?(127\.\d+\.\d+\.\d+|localhost|\[?::1\]?)(:\d+)?$")


def reason(error: Exception) -> str:
    """Return why a port cannot be opened, in the system's words where it gave a number."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if isinstance(number, int) else str(error)


def remedy(url: str, error: Exception) -> str:
    """Return what to check of a port that cannot be opened."""
    if is_can_address(url):
        return can_port.remedy(url, error)
    number = getattr(error, "errno", None)
    if number == errno.EACCES:
        return f"that this user has access to the port: {permission_command(url)}"
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        if users := users_of(url):
            return f"which other process has it open: {', '.join(users)}; end that process"
        return f"which other process has it open: run `fuser -v {url}`, and end that process"
    if number == errno.ENOENT:
        ports = sorted(str(path) for path in BY_ID.glob("*")) if BY_ID.is_dir() else []
        found_text = f"; the ports are {', '.join(ports)}" if ports else f"; `ls {BY_ID}` lists all ports"
        return f"the cable and the port's name{found_text}"
    return "the cable, the name of the port, and which other process uses the port"


def silence_remedy(url: str) -> str:
    """Return what to check where nothing comes from a port that is open: "power, cable", or the program behind it.

    `url` is a port or a host. A pseudo-terminal has neither power nor cable: at its other end is a program of this
    computer, as a simulator or one that hands on a port of another computer; so it is with an address of this computer
    itself. The program is late where the computer is busy.
    """
    if LOOPBACK.match(url):
        return "that the program at this address of this computer runs and is not held up by other programs,"
    if os.path.realpath(url).startswith(PSEUDO_TERMINALS):
        return "that the program at the other end of this pseudo-terminal runs and is not held up by other programs,"
    return "power, cable"


def permission_command(url: str) -> str:
    """Return what gives this user the right to use a port: membership in the port's group, `dialout` on Debian."""
    try:
        group = Path(url).group()
    except (OSError, KeyError):
        group = "dialout"
    return f"run `sudo usermod -aG {'dialout' if group == 'root' else group} $USER`, then log in again"


def users_of(url: str) -> list[str]:
    """Return the other processes that have a port open, each as `process 812 (ModemManager)`, as far as may be seen.

    The process that made a pseudo-terminal has both of its ends open: it is the device, and no other user of the port.
    """
    real, own_pid = os.path.realpath(url), str(os.getpid())
    users = []
    for process in PROCESSES.glob("[0-9]*"):
        if process.name == own_pid:
            continue
        try:
            open_files = {os.path.realpath(link) for link in (process / "fd").iterdir()}
            has_open = real in open_files and MASTERS.isdisjoint(open_files)
            name = (process / "comm").read_text(encoding="utf-8", errors="replace").strip() if has_open else ""
        except OSError:  # another user's, or over
            continue
        if has_open:
            users.append(f"process {process.name} ({name})")
    return sorted(users)


def stable_name(url: str) -> str:
    """Return a port's path that does not depend on the order of plugging; empty where there is none.

    That is its path by USB adapter where the adapter has one of its own, else by the socket.
    """
    real = os.path.realpath(url)
    for folder in (BY_ID, BY_PATH):
        for link in sorted(folder.glob("*")) if folder.is_dir() else []:
            if os.path.realpath(link) == real:
                return str(link)
    return ""
