"""Exceptions that pyserial raises when the wire of an open port is gone."""

from __future__ import annotations

import importlib

import serial


def _terminal_error() -> type[Exception]:
    """Return the error of the system's terminals; OSError on a system without terminals."""
    try:
        found: type[Exception] = importlib.import_module("termios").error
    except ImportError:
        return OSError
    return found


#: Emptying the buffers of a port that went away raises the terminal's own error, which is not an OSError.
BROKEN: tuple[type[Exception], ...] = (serial.SerialException, OSError, _terminal_error())
