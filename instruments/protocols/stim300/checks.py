"""Whether a STIM300 is set as its bench file says, and which one it is."""

from __future__ import annotations

from instruments.protocols.stim300.datagrams import RATE_UNITS, SERIAL_PATTERN, Configuration
from instruments.protocols.stim300.settings import Stim300Settings

UNIT_NAMES = {
    "rate": "ANGULAR RATE",
    "incremental": "INCREMENTAL ANGLE",
    "average": "AVERAGE ANGULAR RATE",
    "integrated": "INTEGRATED ANGLE",
}
DEFAULT_RATE_HZ = 125.0


def differences(configuration: Configuration, settings: Stim300Settings) -> list[str]:
    """Return the settings of a unit that differ from its bench file, one phrase each."""
    options, differing = settings.options, []
    if configuration.unit not in RATE_UNITS:
        differing.append(
            f"the gyro output unit is {UNIT_NAMES[configuration.unit]} in deg instead of ANGULAR RATE or AVERAGE "
            "ANGULAR RATE"
        )
    rate_hz = settings.sample_rate_hz or DEFAULT_RATE_HZ
    if configuration.sample_rate_hz not in {None, rate_hz}:  # None: external trigger; the stream shows its rate
        differing.append(f"the sample rate is {configuration.sample_rate_hz} Hz instead of {rate_hz:g} Hz")
    if options.datagram not in configuration.datagrams:
        differing.append(f"the datagram is 0x{configuration.datagrams[0]:02X} instead of 0x{options.datagram:02X}")
    if configuration.crlf != options.crlf:
        differing.append(f"CR LF {'on' if configuration.crlf else 'off'}, bench file {'on' if options.crlf else 'off'}")
    if missing := [axis for axis in settings.axes if axis not in configuration.axes]:
        differing.append(f"the gyro axes are {' '.join(configuration.axes) or 'none'}, without {' '.join(missing)}")
    return differing


def is_other_serial(serial: str, given_serial: str) -> bool:
    """Return whether the serial number of a bench file is that of another STIM300; False for any other name."""
    digits = SERIAL_PATTERN.fullmatch(given_serial)
    return digits is not None and digits[1] != serial[1:]
