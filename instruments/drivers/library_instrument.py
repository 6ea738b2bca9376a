"""One adapter for the instruments of PyMeasure and of MSL-Equipment: attributes by name, errors in one line.

A class of PyMeasure speaks through the ports of the bench, so that its bytes are those of a driver here. A class of
MSL-Equipment opens its own connection.
"""

from __future__ import annotations

import contextlib
import importlib
import warnings
from typing import Any

from instruments.clock import Clock
from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply, RequestRejected, one_line
from instruments.protocols.library_settings import LibraryOptions
from instruments.transport.factory import Ports
from instruments.transport.serial import BROKEN, SerialPort
from instruments.transport.serial_stream import line_of

LONGEST_REPLY_BYTES = 4096
#: Attributes or methods by which classes of these libraries tell what the instrument says of itself (`*IDN?` and such).
USUAL_IDENTITIES = ("id", "identity", "idn", "get_identity")


def _in_one_line(text: object) -> str:
    if text is None:
        return ""
    return one_line(", ".join(str(part) for part in text) if isinstance(text, list | tuple) else str(text))


class LibraryInstrument:
    """An instrument of another library, opened at first use."""

    def __init__(self, device: str, settings: LibraryOptions, ports: Ports, clock: Clock) -> None:
        self.device = device
        self._settings, self._ports, self._clock = settings, ports, clock
        self._instrument: Any = None
        self._port: SerialPort | None = None
        self._tells_nothing = False  #: asked by default, without an answer

    def identity(self) -> str:
        """Return what the instrument says of itself, in one line; empty where it says nothing.

        The attribute is that of the bench file; without one the usual attribute of the class is asked, and an
        instrument that does not answer that counts as one that says nothing. Raises InstrumentError for an attribute
        of the bench file that cannot be read, and where the class cannot be opened.
        """
        wanted = self._settings.identity
        if wanted is not None:
            return _in_one_line(self.get(wanted)) if wanted else ""
        with self._one_line("open"):
            class_ = type(self._opened())
        usual = next((name for name in USUAL_IDENTITIES if hasattr(class_, name)), None)
        if usual is None or self._tells_nothing:
            return ""
        try:
            return _in_one_line(self.get(usual))
        except InstrumentError:  # a broken link is found by the next reading
            self._tells_nothing = True
            return ""

    def get(self, attribute: str) -> object:
        """Return the value of an attribute, or what a method without arguments returns. Raises InstrumentError."""
        with self._one_line(f"read {attribute}"):
            value = getattr(self._opened(), attribute)
            return value() if callable(value) else value

    def number(self, attribute: str) -> float:
        """Return a value as a number; raises MalformedReply for none, and as `get` does."""
        value = self.get(attribute)
        with contextlib.suppress(ValueError):
            if isinstance(value, int | float | str):
                return float(value)
        raise MalformedReply(
            self.device,
            f"attribute {attribute} holds {value!r}, which is not a number; correct the bench file: name the "
            "attribute that holds the measured value",
        )

    def set(self, attribute: str, value: float) -> None:
        """Set an attribute, or call a method with the value. Raises InstrumentError."""
        with self._one_line(f"set {attribute} to {value:g}"):
            instrument = self._opened()
            if callable(getattr(type(instrument), attribute, None)):
                getattr(instrument, attribute)(value)
            else:
                setattr(instrument, attribute, value)

    def call(self, method: str) -> None:
        """Call a method without arguments. Raises InstrumentError."""
        with self._one_line(f"call {method}"):
            getattr(self._opened(), method)()

    def close(self) -> None:
        """Close the link; safe to call twice. The next use opens it again."""
        instrument, self._instrument = self._instrument, None
        if hasattr(instrument, "disconnect"):
            with self._one_line("disconnect"):
                instrument.disconnect()
        if self._port is not None:
            self._port.close()
            self._port = None

    @contextlib.contextmanager
    def _one_line(self, what: str) -> Any:
        """Turn every error of the library into an InstrumentError; the link is opened again after one."""
        library = self._settings.library
        try:
            yield
        except InstrumentError:
            self._forget()
            raise
        except AttributeError as error:
            raise RequestRejected(
                self.device, f"cannot {what}: {one_line(error)}; correct the name in the bench file"
            ) from error
        except (ValueError, TypeError) as error:
            raise RequestRejected(
                self.device,
                f"{library} refused to {what} ({one_line(error)}); check the value, and the message on the "
                "panel of the instrument",
            ) from error
        except Exception as error:
            self._forget()
            raise LinkError(
                self.device,
                f"{library} cannot {what} ({type(error).__name__}: {one_line(error)}); check cable and power",
            ) from error

    def _forget(self) -> None:
        self._instrument = None
        if self._port is not None:
            self._port.close()
            self._port = None

    def _opened(self) -> Any:
        if self._instrument is None:
            try:
                make = self._of_pymeasure if self._settings.library == "pymeasure" else self._of_msl
                self._instrument = make()
            except ImportError as error:
                raise LinkError(
                    self.device,
                    f"{self._settings.instrument} cannot be imported ({one_line(error)}); install "
                    f"{self._settings.library} (`pip install {self._settings.library}`), or correct the name",
                ) from error
        return self._instrument

    def _of_msl(self) -> Any:
        settings = self._settings
        manufacturer, _, model = settings.instrument.partition(":")
        equipment = importlib.import_module("msl.equipment")
        serial = str(getattr(settings, "serial", ""))
        connection = equipment.Connection(
            settings.address, manufacturer=manufacturer, model=model, serial=serial, **settings.arguments
        )
        return connection.connect()

    def _of_pymeasure(self) -> Any:
        settings = self._settings
        module, _, name = settings.instrument.partition(":")
        driver_class = getattr(importlib.import_module(module), name)
        base = importlib.import_module("pymeasure.adapters").Adapter
        adapter = type("PortAdapter", (base,), {"_write": self._write, "_read": self._read,
                       "_write_bytes": self._write_bytes, "_read_bytes": self._read_bytes,
                       "flush_read_buffer": self._flush, "close": lambda _: None})  # fmt: skip
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FutureWarning)  # to PyMeasure's maintainers, not to who calibrates
            return driver_class(adapter(), **settings.arguments)

    def _open_port(self) -> SerialPort:
        if self._port is None:
            settings = self._settings
            self._port = self._ports.serial(
                settings.address_url, device=self.device, baudrate=settings.baudrate, timeout_s=settings.timeout_s,
                line=line_of(settings.options),
            )  # fmt: skip
        return self._port

    def _write(self, command: str, **_: Any) -> None:
        self._write_bytes((command + self._settings.end).encode("latin-1"))

    def _write_bytes(self, content: bytes, **_: Any) -> None:
        try:
            port = self._open_port()
            port.reset_input_buffer()  # a late reply is not the answer to this
            port.write(content)
        except BROKEN as error:
            raise self._broken(error) from error

    def _read(self, **_: Any) -> str:
        """Return the next line without its end; raises NoReply, LinkError."""
        return self._read_bytes(-1, break_on_termchar=True).strip(b"\r\n").decode("latin-1")

    def _read_bytes(self, count: int, break_on_termchar: bool = False, **_: Any) -> bytes:
        try:
            port, data = self._open_port(), b""
            deadline_s = self._clock.now_s() + self._settings.timeout_s
            while len(data) < LONGEST_REPLY_BYTES and self._clock.now_s() <= deadline_s:
                data += port.read(1)
                ended = break_on_termchar and data.strip(b"\r\n") and data[-1:] in b"\r\n"
                if ended or len(data) == count:
                    return data
        except BROKEN as error:
            raise self._broken(error) from error
        if data and count < 0 and not break_on_termchar:
            return data
        raise NoReply(self.device, f"no answer on {self._settings.address_url}; check power, cable and line settings")

    def _flush(self) -> None:
        self._open_port().reset_input_buffer()

    def _broken(self, error: Exception) -> LinkError:
        return LinkError(
            self.device, f"the link {self._settings.address_url} was lost ({one_line(error)}); check cable and power"
        )
