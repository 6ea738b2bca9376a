"""Questions and commands of a description over a line link; every failure is an InstrumentError."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from instruments.drivers.serial_numbers import refuse_other_serial
from instruments.errors import MalformedReply, RequestRejected, WrongInstrument
from instruments.protocols.request_reply.parts import Ask, AskAlarms, AskNumber, AskState, AskText, LineDescription
from instruments.protocols.request_reply.templates import filled
from instruments.transport.line_link import TRIES, LineLink

#: Errors of earlier requests that an instrument may still hold.
MAX_OLD_ERRORS = 20
SHOWN = 60
NONE: Mapping[str, object] = MappingProxyType({})


class Dialogue:
    """One described instrument. `names` are the parameters that requests hold in braces."""

    def __init__(self, link: LineLink, line: LineDescription, names: Mapping[str, object]) -> None:
        self.link, self._line, self._names = link, line, dict(names)
        self._errors_are_old = True  #: what the instrument holds as errors was not caused by this driver
        self._started_at = 0

    @property
    def is_new(self) -> bool:
        """Whether the link was opened, or is to be opened, since `started`: what was set may be forgotten."""
        return self.link.openings == 0 or self.link.openings != self._started_at

    def started(self) -> None:
        """Note that everything that has to be sent over a new link was sent."""
        self._started_at = self.link.openings

    def ended(self) -> None:
        """Note that what was sent over the link is undone: it has to be sent again before the next command."""
        self._started_at = 0

    def identity(self, ask: AskText, serial: str = "") -> str:
        """Return what the instrument says it is.

        Raises WrongInstrument for a reply that does not fit, and for one without the `serial` number of the bench file.
        """
        reply = self.link.ask(self.request(ask.send), r".*\S.*", "say what it is")[0]
        match = re.fullmatch(ask.pattern, reply)
        if match is None:
            raise WrongInstrument(
                self.link.device,
                f"{self.link.url} answered {reply[:SHOWN]!r} to {self.request(ask.send)!r}, which does not fit the "
                f"pattern {ask.pattern!r} of its description; check the address, or correct [identity]",
            )
        refuse_other_serial(self.link.device, reply, serial, holds_serial=True)
        return match["text"].strip()

    def text(self, ask: Ask, what: str) -> str:
        """Return a text."""
        return self._answer(ask, what).strip()

    def number(self, ask: AskNumber, what: str) -> float:
        """Return a number, in the unit of the instrument; raises MalformedReply where the answer is none."""
        reply = self._answer(ask, what)
        try:
            number = float(reply)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self._malformed(reply, what, "a number")
        return number

    def holds(self, ask: AskState, what: str) -> bool:
        """Return whether a state holds; raises MalformedReply where the answer is neither yes nor no."""
        reply = self._answer(ask, what).strip()
        holds = ask.holds(reply)
        if holds is None:
            rule = f"yes = {ask.yes!r} or no = {ask.no!r}" if ask.yes is not None else "a number as its rule needs"
            raise self._malformed(reply, what, rule)
        return holds

    def alarms(self, ask: AskAlarms) -> tuple[str, ...]:
        """Return the active alarms."""
        return ask.alarms(self.text(ask, "read its alarms"))

    def command(
        self, lines: Sequence[str], what: str, values: Mapping[str, object] = NONE, *, tries: int = TRIES
    ) -> None:
        """Send commands in order, each with its acknowledgement and check.

        Raises RequestRejected for one that the instrument refuses, NoReply, MalformedReply, LinkError.
        """
        for template in lines:
            self._forget_old_errors()
            request = self.request(template, values)
            try:
                self._send(template, request, what, tries)
            except RequestRejected:
                if template not in self._line.may_refuse:
                    raise

    def _send(self, template: str, request: str, what: str, tries: int) -> None:
        if self._line.acknowledged is not None:
            timeout_s = self._line.slow_s if template in self._line.slow else None
            self.link.ask(request, self._line.acknowledged, f"{what} ({request})", tries=tries, timeout_s=timeout_s)
        else:
            self.link.tell(request, what)
        self._check(request, what)

    def stop(self, lines: Sequence[str]) -> None:
        """Send the commands of a stop before anything else; raises LinkError."""
        self._errors_are_old = True  # a stop that is sent twice, or into half a line, may leave one
        self.link.send_at_once([self.request(line) for line in lines], "stop")

    def request(self, template: str, values: Mapping[str, object] = NONE) -> str:
        """Return a request with its values."""
        return filled(template, {**self._names, **values})

    def _answer(self, ask: Ask, what: str) -> str:
        match = self.link.ask(self.request(ask.send), ask.pattern, what)
        return str(next(value for value in match.groupdict().values() if value is not None))

    def _check(self, request: str, what: str) -> None:
        """Raise RequestRejected where the instrument says that a command was an error."""
        check = self._line.check
        if check is None:
            return
        reply = self.text(check, "say whether a command was an error")
        if not re.fullmatch(check.passes, reply):
            why = self._line.reasons.get(reply, reply)
            raise RequestRejected(
                self.link.device,
                f"refused to {what}: {why!r} after {request!r}; check its mode and limits, or correct its description",
            )

    def _forget_old_errors(self) -> None:
        check = self._line.check
        if not self._errors_are_old or check is None:
            return
        for _ in range(MAX_OLD_ERRORS):
            reply = self.text(check, "say what errors it holds")
            if re.fullmatch(check.passes, reply):
                self._errors_are_old = False
                return
        raise RequestRejected(
            self.link.device,
            f"holds the error {reply!r} however often it is asked; clear it at the instrument, or correct check in "
            "the description",
        )

    def _malformed(self, reply: str, what: str, wanted: str) -> MalformedReply:
        return MalformedReply(
            self.link.device,
            f"answered {reply[:SHOWN]!r} to the request to {what}, which is not {wanted}; correct the description, or "
            "check cable and line settings",
        )
