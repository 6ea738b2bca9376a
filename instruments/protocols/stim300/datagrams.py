"""What a STIM300 says of itself: serial number, configuration, bias trim (data sheet TS1524 rev. 31, 5.5.2-5.5.4)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from instruments.protocols.stim300.layouts import (
    AUXILIARY,
    BIAS_TRIM,
    CONFIGURATION,
    PLAIN,
    PPS,
    SERIAL_NUMBER,
    SPECIALS,
    Content,
    content_of,
    crc32_mpeg2,
)

#: Normal-mode commands (section 8); the unit answers by a datagram in place of the next reading.
ASK_CONFIGURATION, ASK_SERIAL_NUMBER, ASK_BIAS_TRIM, RESET = b"C\r", b"I\r", b"T\r", b"R\r"

OutputUnit = Literal["rate", "incremental", "average", "integrated"]
OUTPUT_UNITS: tuple[OutputUnit, ...] = ("rate", "incremental", "average", "integrated")
DELAYED = 0x08  #: bit of the output unit: gyro and accelerometer delayed alike, which changes no scale
RATE_UNITS = ("rate", "average")  #: deg/s
SAMPLE_RATES_HZ = (125, 250, 500, 1000, 2000)
EXTERNAL_TRIGGER = 5  #: code of the sample rate
BIT_RATES = {0: 374_400, 1: 460_800, 2: 921_600, 3: 1_843_200}
USER_DEFINED = 15  #: code of the bit rate
PARITIES: tuple[Literal["none", "even", "odd"], ...] = ("none", "even", "odd")
FILTERS_HZ = (16, 33, 66, 131, 262)  #: frequency at -3 dB of the low-pass filters of the gyros
RANGES_DPS = (400,)
#: Compensation of the gyros for specific force: source of bias and of scale, and the low-pass filter of each.
G_COMPENSATIONS = {
    0: "off", 1: "scale by accelerometer", 2: "scale by accelerometer, 0.01 Hz", 3: "bias by accelerometer",
    4: "bias by accelerometer, 0.01 Hz", 5: "bias by inclinometer", 6: "bias by inclinometer, 0.01 Hz",
    7: "bias and scale by accelerometer", 8: "bias by accelerometer, 0.01 Hz, scale by accelerometer",
    9: "bias by inclinometer, scale by accelerometer", 10: "bias by inclinometer, DC, scale by accelerometer",
    11: "bias and scale by accelerometer, 0.01 Hz", 12: "bias and scale by inclinometer, 0.01 Hz", 15: "user-defined",
}  # fmt: skip
TRIM_PER_LSB = 2.0**-14  #: deg/s, whatever the output unit is
ACCELERATION_RANGES_G = {0: 10, 3: 5, 4: 30, 6: 80}
#: Serial number of a unit as it is engraved, and as it is sent: N and 14 digits.
SERIAL_PATTERN = re.compile(r"N?(\d{14})")


@dataclass(frozen=True)
class Configuration:
    """How a unit is set (table 5-16), as far as its readings depend on it."""

    revision: str  #: of the part number
    firmware: int
    sample_rate_hz: int | None  #: None: external trigger
    content: Content
    crlf: bool
    baudrate: int | None  #: None: user-defined
    stop_bits: int
    parity: Literal["none", "even", "odd"]
    axes: str  #: gyro axes that are active
    unit: OutputUnit
    is_delayed: bool
    has_pps: bool  #: a pulse per second; else an auxiliary input
    acceleration_range_g: int | None
    filters_hz: tuple[str, ...] = ("262", "262", "262")  #: of the gyros x, y and z; "code N" for an unknown one
    g_compensation: str = "off"
    ranges_dps: tuple[str, ...] = ("400", "400", "400")  #: of the gyros x, y and z

    @property
    def datagrams(self) -> tuple[int, ...]:
        """Identifiers that its content may have, the likelier one first."""
        if not self.content.pps:
            return (PLAIN[self.content.index],)
        rows = (PPS, AUXILIARY) if self.has_pps else (AUXILIARY, PPS)
        return tuple(row[self.content.index] for row in rows)


def parse_configuration(frame: bytes) -> Configuration | None:
    """Return the content of an intact configuration datagram without CR LF; None where it is another datagram."""
    if frame[0] not in CONFIGURATION:
        return None
    rate, line, gyro = frame[3], frame[4], frame[5]
    code = rate >> 5
    parity = line >> 1 & 3
    return Configuration(
        revision=chr(frame[1]),
        firmware=frame[2],
        sample_rate_hz=SAMPLE_RATES_HZ[code] if code < len(SAMPLE_RATES_HZ) else None,
        content=Content(bool(rate & 2), bool(rate & 4), bool(rate & 8), bool(rate & 16)),
        crlf=bool(rate & 1),
        baudrate=BIT_RATES.get(line >> 4),
        stop_bits=2 if line & 8 else 1,
        parity=PARITIES[parity] if parity < len(PARITIES) else "none",
        axes="".join(axis for axis, bit in (("x", 0x40), ("y", 0x20), ("z", 0x10)) if gyro & bit),
        unit=OUTPUT_UNITS[gyro & 3],
        is_delayed=bool(gyro & DELAYED),
        has_pps=bool(frame[14] & 8),
        acceleration_range_g=ACCELERATION_RANGES_G.get(frame[17] >> 4),
        filters_hz=tuple(_named(FILTERS_HZ, code & 7) for code in (frame[6] >> 4, frame[6], frame[7] >> 4)),
        g_compensation=G_COMPENSATIONS.get(frame[7] & 15, f"code {frame[7] & 15}"),
        ranges_dps=tuple(_named(RANGES_DPS, code & 15) for code in (frame[15] >> 4, frame[15], frame[16] >> 4)),
    )


def _named(values: Sequence[int], code: int) -> str:
    return str(values[code]) if code < len(values) else f"code {code}"


def _code(values: Sequence[int], name: str) -> int:
    return values.index(int(name)) if name.isdecimal() else int(name.removeprefix("code "))


def parse_serial_number(frame: bytes) -> str | None:
    """Return the serial number, N and 14 digits, of an intact datagram; None where it is another datagram."""
    if frame[0] not in SERIAL_NUMBER:
        return None
    return chr(frame[1]) + frame[2:9].hex()


def parse_bias_trim(frame: bytes) -> tuple[float, ...] | None:
    """Return the bias trim offsets of the gyros x, y and z, deg/s, of an intact datagram; None of another one."""
    if frame[0] not in BIAS_TRIM:
        return None
    return tuple(int.from_bytes(frame[at : at + 3], "big", signed=True) * TRIM_PER_LSB for at in (1, 4, 7))


def configuration_frame(configuration: Configuration) -> bytes:
    """Return the configuration datagram, with CR LF where it is set so, of a unit that is set as given."""
    rate_hz = configuration.sample_rate_hz
    code = EXTERNAL_TRIGGER if rate_hz is None else SAMPLE_RATES_HZ.index(rate_hz)
    content = configuration.content
    body = bytearray(21)
    body[0], body[1] = ord(configuration.revision), configuration.firmware
    body[2] = code << 5 | content.pps << 4 | content.temperature << 3 | content.inclination << 2
    body[2] |= content.acceleration << 1 | configuration.crlf
    bit_rates = {baudrate: number for number, baudrate in BIT_RATES.items()}
    bit_rate = USER_DEFINED if configuration.baudrate is None else bit_rates.get(configuration.baudrate, USER_DEFINED)
    body[3] = (
        bit_rate << 4
        | (configuration.stop_bits == 2) << 3
        | PARITIES.index(configuration.parity) << 1
        | configuration.crlf
    )
    body[4] = sum(bit for axis, bit in (("x", 0x40), ("y", 0x20), ("z", 0x10)) if axis in configuration.axes)
    body[4] |= OUTPUT_UNITS.index(configuration.unit) | (DELAYED if configuration.is_delayed else 0)
    x_hz, y_hz, z_hz = (_code(FILTERS_HZ, filter_hz) for filter_hz in configuration.filters_hz)
    compensations = {name: code for code, name in G_COMPENSATIONS.items()}
    body[5], body[6] = x_hz << 4 | y_hz, z_hz << 4 | compensations[configuration.g_compensation]
    body[13] = 8 if configuration.has_pps else 0
    x_dps, y_dps, z_dps = (_code(RANGES_DPS, range_dps) for range_dps in configuration.ranges_dps)
    ranges = {value: number for number, value in ACCELERATION_RANGES_G.items()}
    reach = ranges[configuration.acceleration_range_g or 10]
    body[14], body[15] = x_dps << 4 | y_dps, z_dps << 4
    body[16], body[17] = reach << 4 | reach, reach << 4
    return _frame(CONFIGURATION[configuration.crlf], bytes(body), crlf=configuration.crlf)


def serial_number_frame(serial: str, *, crlf: bool) -> bytes:
    """Return the datagram of a serial number, N and 14 digits."""
    return _frame(SERIAL_NUMBER[crlf], serial[:1].encode() + bytes.fromhex(serial[1:]) + bytes(7), crlf=crlf)


def bias_trim_frame(trim_dps: Sequence[float], *, crlf: bool) -> bytes:
    """Return the datagram of bias trim offsets of the gyros x, y and z, deg/s."""
    words = b"".join(round(each / TRIM_PER_LSB).to_bytes(3, "big", signed=True) for each in trim_dps)
    return _frame(BIAS_TRIM[crlf], words + bytes(35 - len(words)), crlf=crlf)


def _frame(identifier: int, body: bytes, *, crlf: bool) -> bytes:
    covered = bytes([identifier]) + body
    crc = crc32_mpeg2(covered + bytes(SPECIALS[identifier].pad))
    return covered + crc.to_bytes(4, "big") + (b"\r\n" if crlf else b"")


def content_of_datagram(identifier: int) -> tuple[Content, bool]:
    """Return what a datagram holds, and whether its fourth part is a pulse per second, not an auxiliary input."""
    return content_of(identifier), identifier not in AUXILIARY
