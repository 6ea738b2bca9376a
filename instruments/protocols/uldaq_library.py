"""Names and numbers of libuldaq, from its public header uldaq.h, and how it is installed."""

from __future__ import annotations

from enum import IntEnum

PACKAGE = "uldaq"
INSTALL = "pip install labctl[mcc]"
LIBRARY = "libuldaq"
#: The package brings no C library; Debian has none either.
INSTALL_LIBRARY = "./configure && make && sudo make install"
LIBRARY_SOURCE = "https://github.com/mccdaq/uldaq"
#: UDP port at which an Ethernet device is found.
DISCOVERY_PORT = 54211


class UlError(IntEnum):
    """Error numbers that a scan of analog inputs meets."""

    NO_ERROR = 0
    BAD_DEV_HANDLE = 2
    USB_DEV_NO_PERMISSION = 4
    USB_INTERFACE_CLAIMED = 5
    DEV_NOT_FOUND = 6
    DEV_NOT_CONNECTED = 7
    DEAD_DEV = 8
    BAD_RANGE = 13
    BAD_AI_CHAN = 14
    ALREADY_ACTIVE = 16
    OVERRUN = 18
    BAD_RATE = 22
    BAD_INFO_ITEM = 32


TEXTS = {
    UlError.BAD_DEV_HANDLE: "Invalid device handle",
    UlError.USB_DEV_NO_PERMISSION: "Insufficient permission to access this device",
    UlError.USB_INTERFACE_CLAIMED: "USB interface is already claimed",
    UlError.DEV_NOT_FOUND: "Device not found",
    UlError.DEV_NOT_CONNECTED: "Device not connected or connection lost",
    UlError.DEAD_DEV: "Device no longer responding",
    UlError.BAD_RANGE: "Invalid range",
    UlError.BAD_AI_CHAN: "Invalid analog input channel",
    UlError.ALREADY_ACTIVE: "Scan already active",
    UlError.OVERRUN: "FIFO overrun, data was not transferred from device fast enough",
    UlError.BAD_RATE: "Invalid rate",
}


class InputMode(IntEnum):
    """How an input is wired."""

    DIFFERENTIAL = 1
    SINGLE_ENDED = 2


class Interface(IntEnum):
    """Where devices are looked for."""

    USB = 1 << 0


class ScanStatus(IntEnum):
    """Whether the inputs are scanned."""

    IDLE = 0
    RUNNING = 1


#: Scan option: the buffer is filled again and again, until the scan is stopped.
CONTINUOUS = 1 << 3
#: Flag of a scan: volts, by the calibration of the device.
SCALED = 0
#: Largest voltage of a range with both signs -> its number.
BIPOLAR_RANGES = {
    60.0: 1, 30.0: 2, 15.0: 3, 20.0: 4, 10.0: 5, 5.0: 6, 4.0: 7, 2.5: 8, 2.0: 9, 1.25: 10, 1.0: 11, 0.625: 12,
    0.5: 13, 0.25: 14, 0.125: 15, 0.2: 16, 0.1: 17, 0.078: 18, 0.05: 19, 0.01: 20, 0.005: 21, 3.0: 22, 0.312: 23,
    0.156: 24,
}  # fmt: skip
