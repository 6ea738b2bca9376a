"""A bench of instruments that shares no code with labctl: a table, a chamber, a thermometer and a gyro on real ports.

Run as a program; it prints its addresses as one JSON line and serves until its standard input ends. Only the standard
library is used. Facts are from public documents: the two-letter commands, errors and line ends of the Newport ESP301
motion controller (its manual, chapter 3 and appendix A), and IEEE 488.2 and SCPI-99 (`*IDN?`, `SYST:ERR?` and the
numbers of errors) for the chamber and the thermometer. The chamber states deg F.
"""

from __future__ import annotations

import json
import math
import os
import random
import re
import select
import socket
import sys
import threading
import time
import tty
from collections.abc import Callable

SPEED = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
#: What the gyro does to a rate, deg/s.
GYRO_SCALE, GYRO_BIAS_DPS, GYRO_NOISE_DPS = 1.004, 0.25, 0.02
GYRO_HZ = 50.0
BEGAN = time.monotonic()


def now() -> float:
    """Return the time of the bench, s."""
    return (time.monotonic() - BEGAN) * SPEED


class Table:
    """One rotary stage on an ESP301: trapezoids of rate, an error buffer, CR in and CR LF out."""

    MAX_RATE, MAX_ACCELERATION = 80.0, 160.0

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.on = False
        self.speed, self.acceleration = 1.0, 10.0
        self.t, self.angle, self.rate, self.target = 0.0, 3.7, 0.0, 0.0
        self.until: float | None = None  # where a finite move ends, degrees
        self.zero_after = False
        self.errors: list[int] = []
        self.heard: list[str] = []

    def advance(self) -> None:
        """Step the motion to now."""
        t = now()
        while self.t < t:
            step = min(t - self.t, 1e-3 * SPEED)
            if self.until is not None:
                left = self.until - self.angle
                least = math.copysign(math.sqrt(2 * self.acceleration * abs(left)), left)
                self.target = math.copysign(min(abs(least), self.speed), left)
                if abs(left) < 2e-3 and abs(self.rate) < 1.0:
                    self.angle, self.rate, self.target = self.until, 0.0, 0.0
                    self.until = None
                    if self.zero_after:
                        self.angle, self.zero_after = 0.0, False
            change = max(-self.acceleration * step, min(self.acceleration * step, self.target - self.rate))
            self.angle += (self.rate + change / 2) * step
            self.rate += change
            self.t += step

    def line(self, text: str) -> str:
        """Return the replies to one line of commands."""
        with self.lock:
            self.advance()
            self.heard.append(text)
            return "".join(f"{said}\r\n" for part in text.split(";") if (said := self.one(part.strip())) is not None)

    def one(self, text: str) -> str | None:
        """Return the reply to one command; None for none."""
        if not text:
            return None
        found = re.fullmatch(r"(\d*)([A-Z]{2})(.*)", text.upper())
        axis, name, value = found.groups() if found else ("", "", "")
        if name == "VE":
            return "ESP301 Version 3.0.1 6/1/99"
        if name == "TE":
            return str(self.errors.pop(0)) if self.errors else "0"
        if axis != "1":
            self.errors.append(37 if axis == "" else 9)  # axis number missing; out of range
            return None
        return self.axis(name, value)

    def axis(self, name: str, value: str) -> str | None:
        """Carry out a command of the axis."""
        said = {"MD": str(int(self.rate == 0 and self.until is None and self.target == 0)),
                "TP": f"{self.angle:.4f}", "TV": f"{self.rate:.4f}", "ID": "URS100CC, SN1234"}  # fmt: skip
        if name in said:
            return said[name]
        if name in ("VA", "AC", "AG"):
            self.limit(name, float(value) if re.fullmatch(r"[\d.]+", value) else -1.0)
        elif name == "MO":
            self.on = True
        elif name == "ST":
            self.until, self.target = None, 0.0
        elif name in ("MV", "PR", "OR"):
            self.begin(name, value)
        elif name != "SN":
            self.errors.append(6)  # command does not exist
        return None

    def limit(self, name: str, value: float) -> None:
        """Set velocity or acceleration."""
        if not 0 < value <= (self.MAX_RATE if name == "VA" else self.MAX_ACCELERATION):
            self.errors.append(110 if name == "VA" else 111)
        elif name == "VA":
            self.speed = value
        else:
            self.acceleration = value

    def begin(self, name: str, value: str) -> None:
        """Begin a motion."""
        if not self.on:
            self.errors.append(113)  # motor not enabled
        elif name == "MV":
            self.until, self.target = None, self.speed if value == "+" else -self.speed
        else:
            self.until = self.angle + float(value) if name == "PR" else 0.0
            self.zero_after = name == "OR"


class Chamber:
    """A chamber that speaks SCPI, in deg F."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.air_f, self.set_f, self.t, self.on = 75.2, 75.2, 0.0, False
        self.errors: list[str] = []

    def advance(self) -> None:
        """Let the air follow the set point, 6 deg F per second of the bench at most."""
        t = now()
        if self.on:
            most = 6.0 * (t - self.t)
            self.air_f += max(-most, min(most, self.set_f - self.air_f))
        self.t = t

    def line(self, text: str) -> str:
        """Return the reply to a line; a command has none."""
        with self.lock:
            self.advance()
            if text == "SYST:ERR?":
                return (self.errors.pop(0) if self.errors else '0,"No error"') + "\n"
            said = {"*IDN?": "Example Thermal,TC-1,7731,1.04", "MEAS:TEMP?": f"{self.air_f:+.4E},F",
                    "SOUR:TEMP?": f"{self.set_f:.1f}", "OUTP?": str(int(self.on)), "STAT:QUES?": "0"}  # fmt: skip
            if text in said:
                return said[text] + "\n"
            given = re.fullmatch(r"SOUR:TEMP (-?\d+\.\d)", text)
            if given and -40 <= float(given[1]) <= 250:
                self.set_f = float(given[1])
            elif given:
                self.errors.append('-222,"Data out of range"')
            elif text in ("OUTP ON", "OUTP OFF"):
                self.on = text == "OUTP ON"
            else:
                self.errors.append('-113,"Undefined header"')
            return ""


class Thermometer:
    """A thermometer that speaks SCPI, at the chamber's air."""

    def __init__(self, chamber: Chamber) -> None:
        self.chamber = chamber

    def line(self, text: str) -> str:
        """Return the reply to a line."""
        with self.chamber.lock:
            self.chamber.advance()
            air_c = (self.chamber.air_f - 32) / 1.8
        return {"*IDN?": "Example Thermometry,PT-2,55,2.0\n", "READ?": f"{air_c:.3f}\n"}.get(text, "")


def serve_tcp(answer: Callable[[str], str]) -> int:
    """Serve lines on a TCP port."""
    listener = socket.create_server(("127.0.0.1", 0))

    def carry(connection: socket.socket) -> None:
        with connection, connection.makefile("rw", newline="") as lines:
            for text in lines:
                lines.write(answer(text.strip()))
                lines.flush()

    def accept() -> None:
        while True:
            threading.Thread(target=carry, args=(listener.accept()[0],), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    return int(listener.getsockname()[1])


def terminal() -> tuple[int, str, int]:
    """Return our end of a pseudo-terminal, the path of the other end, and that end, which stays open."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    return ours, os.ttyname(theirs), theirs


def serve_table(table: Table) -> str:
    """Serve the table on a pseudo-terminal."""
    ours, path, _ = terminal()

    def carry() -> None:
        data = b""
        while True:
            data += os.read(ours, 4096)
            *whole, data = data.split(b"\r")
            for each in whole:
                os.write(ours, table.line(each.decode("ascii").strip()).encode("ascii"))

    threading.Thread(target=carry, daemon=True).start()
    return path


def serve_gyro(table: Table, chamber: Chamber) -> str:
    """Send `gx,gy,gz,temperature` at a fixed rate on a pseudo-terminal; what is not read is dropped."""
    ours, path, _ = terminal()
    os.set_blocking(ours, False)
    noise = random.Random(7)

    def send() -> None:
        due, tick = now(), threading.Event()
        while True:
            due += 1 / GYRO_HZ
            tick.wait(max(due - now(), 0.0) / SPEED)
            with table.lock:
                table.advance()
                rate = table.rate
            with chamber.lock:
                chamber.advance()
                air_c = (chamber.air_f - 32) / 1.8
            x, y, z = (noise.gauss(0.0, GYRO_NOISE_DPS) for _ in range(3))
            line = f"{x:.5f},{y:.5f},{GYRO_SCALE * rate + GYRO_BIAS_DPS + z:.5f},{air_c:.3f}\r\n".encode()
            if select.select([], [ours], [], 0)[1]:
                try:
                    os.write(ours, line)
                except BlockingIOError:
                    continue

    threading.Thread(target=send, daemon=True).start()
    return path


def say(document: dict[str, object]) -> None:
    """Write one JSON line."""
    sys.stdout.write(json.dumps(document) + "\n")
    sys.stdout.flush()


def main() -> None:
    """Serve until the standard input ends."""
    table, chamber = Table(), Chamber()
    addresses = {
        "table": serve_table(table), "gyro": serve_gyro(table, chamber), "chamber": serve_tcp(chamber.line),
        "thermometer": serve_tcp(Thermometer(chamber).line), "control": serve_tcp(lambda _: "ok\n"),
    }  # fmt: skip
    say(addresses)
    sys.stdin.read()
    table.line("")
    say({"rate_dps": table.rate, "set_f": chamber.set_f, "heard": table.heard})


if __name__ == "__main__":
    main()
