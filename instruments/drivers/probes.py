"""The probes of labctl's own drivers."""

from __future__ import annotations

import re

import numpy as np
from pymodbus.client import ModbusTcpClient
from pymodbus.framer import FramerRTU

from instruments.drivers.probe import HostProbe, Probe, Recognised, words_of
from instruments.protocols import adam6017, arrick_c4_lines, watlow_f4_registers, watlow_f4t_registers
from instruments.protocols.kvh_lines import DSP3000, RD2100, LineFormat, parse_line
from instruments.protocols.modbus_codes import READ_HOLDING
from instruments.protocols.stim300.checks import DEFAULT_RATE_HZ
from instruments.protocols.stim300.frames import COUNTS_PER_S, LAYOUTS, Scan, layout_of, scan
from instruments.protocols.stim300.settings import DatagramOptions

#: This many intact frames or lines, with no damage but incomplete ones at both ends, identify an instrument.
MIN_FRAMES = 4
SERIAL = "the unit's serial number, from its label"
RATE = "the largest rate of the unit, deg/s, from its data sheet"


def _stim300(data: bytes, baudrate: int) -> Recognised | None:
    best: tuple[int, Scan, DatagramOptions] | None = None
    for datagram in LAYOUTS:
        if data.count(datagram) < MIN_FRAMES:
            continue
        for crlf in (False, True):
            options = DatagramOptions.model_validate({"datagram": datagram, "crlf": crlf, "baudrate": baudrate})
            frames = scan(data, layout_of(options))
            score = len(frames.frames) - frames.damaged
            if len(frames.frames) >= MIN_FRAMES and (best is None or score > best[0]):
                best = score, frames, options
    if best is None:
        return None
    _, frames, options = best
    counter = frames.frames[:, layout_of(options).counter].astype(np.int64)
    step = int(np.median(np.diff(counter) % 256)) or 1
    rate_hz = COUNTS_PER_S / step
    settings: dict[str, object] = {"technology": "mems", "axes": ["x", "y", "z"], "max_rate_dps": 400.0}
    settings["sample_rate_hz"] = rate_hz
    if options_stated := options.model_dump(exclude_defaults=True):
        settings["options"] = options_stated
    text = f"Sensonor STIM300, datagram 0x{options.datagram:02X} at {rate_hz:g} readings/s (usual {DEFAULT_RATE_HZ:g})"
    return Recognised(text, settings, {"serial": SERIAL})


def _lines(data: bytes, line: LineFormat) -> int:
    """Return the number of complete lines; 0 where one does not fit the format, or there are too few."""
    whole = data.split(b"\n")[1:-1]
    pattern = re.compile(line.pattern)
    fit = [parse_line(each.rstrip(b"\r").decode("latin-1"), pattern, line.length) for each in whole]
    return len(fit) if all(fit) and len(fit) >= MIN_FRAMES else 0


def _dsp3000(data: bytes, baudrate: int) -> Recognised | None:
    if not _lines(data, DSP3000):
        return None
    options = {} if baudrate == DSP3000.baudrate else {"options": {"baudrate": baudrate}}
    settings = {"technology": "fog", "axes": ["z"], "max_rate_dps": DSP3000.limit_dps, **options}
    return Recognised("KVH DSP-3000", settings, {"serial": SERIAL})


def _rd2100(data: bytes, baudrate: int) -> Recognised | None:
    if not _lines(data, RD2100):
        return None
    options = {} if baudrate == RD2100.baudrate else {"options": {"baudrate": baudrate}}
    settings = {"technology": "fog", "axes": ["z"], "max_rate_dps": 100.0, **options}
    return Recognised("KVH E-Core RD2100, by its lines", settings, {"serial": SERIAL, "max_rate_dps": RATE})


def _c4(data: bytes, _baudrate: int) -> Recognised | None:
    text = data.decode("latin-1").strip()
    if not text.startswith(arrick_c4_lines.IDENTITY_PREFIX):
        return None
    settings: dict[str, object] = {"max_rate_dps": 100.0, "acceleration_dps2": 90.0}
    confirm = {
        "max_rate_dps": "the largest rate of the table, deg/s",
        "acceleration_dps2": "its ramp, deg/s^2",
        "speed_template": "the C4's speed command from its manual, with {divisor}; without this command the "
        "table cannot turn at a rate",
    }
    return Recognised(text, settings, confirm)


def _f4_request() -> bytes:
    body = bytes([1, READ_HOLDING, *watlow_f4_registers.MODEL.number.to_bytes(2, "big"), 0, 1])
    return body + FramerRTU.compute_CRC(body).to_bytes(2, "big")


def _f4(data: bytes, baudrate: int) -> Recognised | None:
    body = bytes([1, READ_HOLDING, 2]) + watlow_f4_registers.MODEL_F4.to_bytes(2, "big")
    if body + FramerRTU.compute_CRC(body).to_bytes(2, "big") not in data:
        return None
    return Recognised("Watlow F4", {} if baudrate == F4.baudrates[0] else {"baudrate": baudrate})


def _f4t(client: ModbusTcpClient) -> Recognised | None:
    letters = words_of(client, watlow_f4t_registers.PART_NUMBER.number, watlow_f4t_registers.PART_NUMBER_LETTERS)
    part = "".join(chr(letter) for letter in letters if 32 < letter < 127)
    return Recognised(f"Watlow {part}") if part.startswith("F4T") else None


def _adam6017(client: ModbusTcpClient) -> Recognised | None:
    if words_of(client, adam6017.MODULE_NAME.number, 1) != [adam6017.MODULE_6017]:
        return None
    codes = words_of(client, adam6017.RANGE_CODE.number, 1)
    options = {"options": {"range_code": codes[0]}} if codes and codes[0] in adam6017.RANGES_V else {}
    settings = {"technology": "piezo", "axes": ["z"], "max_rate_dps": 80.0, **options}
    return Recognised("Advantech ADAM-6017", settings, {"serial": SERIAL, "max_rate_dps": RATE})


STIM300 = Probe((460_800, 921_600, 1_843_200, 374_400), _stim300)
DSP_3000 = Probe((38_400,), _dsp3000)
RD_2100 = Probe((9_600,), _rd2100, wait_s=1.2)
#: The line end before it ends what an earlier process may have left half sent.
C4 = Probe((9_600,), _c4, asks=f"\r{arrick_c4_lines.command(arrick_c4_lines.IDENTIFY)}\r".encode())
F4 = Probe((19_200, 9_600), _f4, asks=_f4_request())
F4T = HostProbe(_f4t)
ADAM_6017 = HostProbe(_adam6017)
