"""Serial link to the Arrick C4: commands out, reply letters in, every failure an InstrumentError."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn

from instruments.clock import Clock
from instruments.errors import LinkError, NoReply, RequestRejected
from instruments.protocols import arrick_c4_lines as lines
from instruments.protocols.arrick_c4_settings import ArrickC4Settings
from instruments.transport.factory import Ports
from instruments.transport.port_failures import silence_remedy
from instruments.transport.serial import BROKEN, SerialPort
from instruments.transport.serial_stream import line_of

REPLY_S = 1.0
#: Longest wait for the answer to the question whether the table moves, s.
STATE_S = 0.5
#: Replies of an earlier move that can arrive before the reply to the present command.
LATE_LETTERS = lines.ACCEPTED + lines.FINISHED
LINE_END = b"\r\n"
#: More of them belong to no earlier move.
MAX_LATE_LETTERS = 20
LINE_IS_BUSY = (
    "letters arrive that answer no command; find what else sends on this line, or switch the controller off and on"
)


class C4Link:
    """The port of one controller, opened at first use; `opened` is called each time, for what has to be sent again."""

    def __init__(
        self, device: str, settings: ArrickC4Settings, ports: Ports, clock: Clock, opened: Callable[[], None]
    ) -> None:
        self._device, self._settings = device, settings
        self._ports, self._clock = ports, clock
        self._opened = opened
        self._port: SerialPort | None = None
        self._initialised = False

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return self._port is not None

    def open(self) -> SerialPort:
        """Return the port, opened where it was closed; raises LinkError."""
        if self._port is None:
            settings = self._settings
            self._port = self._ports.serial(
                settings.port, device=self._device, baudrate=settings.baudrate, timeout_s=REPLY_S,
                line=line_of(settings.line),
            )  # fmt: skip
            self._initialised = False
            self._opened()
        return self._port

    def close(self) -> None:
        """Close the port; safe to call twice."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def discard_input(self) -> None:
        """Drop unread replies; raises LinkError."""
        try:
            self.open().reset_input_buffer()
        except BROKEN as error:
            self._fail(error)

    def send(self, command: str) -> None:
        """Send a command line with the terminator of the bench file; raises LinkError."""
        try:
            self.open().write((command + self._settings.terminator).encode("ascii"))
        except BROKEN as error:
            self._fail(error)

    def read_letter(self, timeout_s: float = REPLY_S, skip: str = "") -> str:
        """Return the next letter that is neither a line end nor one of `skip`; raises NoReply or LinkError."""
        port = self.open()
        deadline_s = self._clock.now_s() + timeout_s
        skipped = 0
        try:
            while True:
                port.timeout = self._port_timeout_s(deadline_s)
                letter = bytes(port.read(1))
                if letter and letter not in LINE_END and letter.decode("latin-1") not in skip:
                    return letter.decode("latin-1")
                skipped += len(letter)
                if self._clock.now_s() >= deadline_s - 1e-9 and (not letter or skipped > MAX_LATE_LETTERS):
                    silent = f"check {silence_remedy(self._settings.port)} and baud rate"
                    advice = LINE_IS_BUSY if skipped > MAX_LATE_LETTERS else silent
                    raise NoReply(self._device, f"{self._settings.port} gave no answer in {timeout_s:.1f} s; {advice}")
        except BROKEN as error:
            self._fail(error)

    def read_state(self) -> tuple[str, float | None]:
        """Return the answer to the question for the state, and when a move ended, clock time, if its end came before.

        The answer is empty where none came: a controller may not answer while it moves. Raises LinkError.
        """
        ended_s: float | None = None
        with suppress(NoReply):
            letter = self.read_letter(STATE_S)
            if letter != lines.FINISHED:
                return letter, None
            ended_s = self._clock.now_s()
            return self.read_letter(STATE_S), ended_s
        return "", ended_s

    def initialise(self) -> None:
        """Send the commands of the bench file that come before any motion; once for each opening of the link.

        Raises RequestRejected for another reply than expected, NoReply or LinkError.
        """
        self.open()
        if self._initialised:
            return
        for command in self._settings.init_commands:
            self.send(command.send)
            if command.expect is None:
                self._clock.sleep(REPLY_S)  # it may answer nevertheless, which is no reply to what follows
                self.discard_input()
            elif (line := self.read_line(skip="")) != command.expect:
                raise RequestRejected(
                    self._device,
                    f"answered {line!r} to {command.send}, but init_commands in the bench file expects "
                    f"{command.expect!r}; correct init_commands by the manual of the controller",
                )
        self._initialised = True

    def read_line(self, skip: str = LATE_LETTERS) -> str:
        """Return the next line of text, from its first letter that is none of `skip`; raises NoReply or LinkError."""
        text = self.read_letter(skip=skip)
        port = self.open()
        while (character := bytes(port.read(1))) and character not in LINE_END:
            text += character.decode("latin-1")
        return text

    def expect(self, letter: str, purpose: str, timeout_s: float = REPLY_S) -> None:
        """Read one letter; raises RequestRejected for another one (`purpose` is named), NoReply or LinkError.."""
        received = self.read_letter(timeout_s)
        if received != letter:
            raise RequestRejected(
                self._device, f"answered {received!r} instead of {letter!r}, so it did not {purpose}; home the table"
            )

    def _port_timeout_s(self, deadline_s: float) -> float:
        remaining_s = max(deadline_s - self._clock.now_s(), 0.0)
        if remaining_s == 0:
            return 0.0
        return self._ports.port_timeout_s(self._settings.port, remaining_s, device=self._device)

    def _fail(self, error: Exception) -> NoReturn:
        self.close()
        raise LinkError(
            self._device, f"the link {self._settings.port} broke ({error}); check the cable, then try again"
        ) from error
