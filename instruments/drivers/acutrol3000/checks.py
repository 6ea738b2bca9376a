"""What the driver of an ACUTROL 3000 finds out before a motion and after one failed: interlocks, faults and limits."""

from __future__ import annotations

import re

from instruments.clock import Clock
from instruments.drivers.acutrol3000.link import AcutrolLink
from instruments.errors import MalformedReply, RequestRejected, WrongInstrument
from instruments.protocols.acutrol3000 import commands as acl
from instruments.protocols.acutrol3000.settings import Acutrol3000Settings

#: An interlock closes within this time, s: drives are enabled after a delay that the controller is configured for.
CLOSE_S, POLL_S = 15.0, 0.2


def numbers(device: str, text: str, least: int) -> list[float]:
    """Return the numbers of a reply, separated by commas or semicolons; raises MalformedReply for fewer or others."""
    try:
        values = [float(part) for part in re.split("[;,]", text) if part.strip()]
    except ValueError:
        values = []
    if len(values) < least:
        raise MalformedReply(device, f"answered {text!r}, but {least} numbers were expected; check axis and cable")
    return values


def check_factory_limits(device: str, settings: Acutrol3000Settings, limits: list[float]) -> None:
    """Compare rate and acceleration of the bench file with the controller's absolute limits; raises WrongInstrument."""
    expected = {"max_rate_dps": settings.max_rate_dps, "acceleration_dps2": settings.acceleration_dps2}
    for (key, value), limit in zip(expected.items(), limits, strict=False):
        if value > limit * (1 + 1e-9):
            raise WrongInstrument(
                device,
                f"the bench file sets {key} = {value:g}, but the absolute limit of the controller is {limit:g}; "
                "lower the value in the bench file",
            )


def interlock(axis: int, link: AcutrolLink) -> str:
    """Return the state of the interlock by its first letter: closed, open or fault."""
    return link.ask(f":Interlock? {axis}")[:1].upper()


def interlock_cause(device: str, axis: int, link: AcutrolLink) -> str:
    """Return why the interlock is not closed, to append to a message; empty while it is."""
    state = interlock(axis, link)
    if state == acl.CLOSED:
        return ""
    causes = [
        name
        for register, names in (("INTLK", acl.INTERLOCKS), ("SWFLT", acl.SOFTWARE_FAULTS))
        for name in acl.named_bits(int(numbers(device, link.ask(acl.register(f"A{axis}{register}")), 1)[0]), names)
    ]
    named = f" ({', '.join(causes)})" if causes else ""
    return f"; its interlock is {'at fault' if state == acl.FAULT else 'open'}{named}"


def close_interlock(device: str, settings: Acutrol3000Settings, link: AcutrolLink, clock: Clock) -> None:
    """Close the interlock where it is open; a fault is reset only where the bench file says so.

    Raises RequestRejected with what is at fault.
    """
    axis = settings.axis
    state = interlock(axis, link)
    if state == acl.CLOSED:
        return
    if state == acl.FAULT:
        cause = interlock_cause(device, axis, link)
        if not settings.reset_interlocks:
            raise RequestRejected(
                device,
                f"cannot move{cause}; remove the cause, then reset the interlock at the controller, or set "
                "reset_interlocks = true in the bench file",
            )
        link.ask(":Interlock:Reset")
    link.ask(acl.off(axis))  # an earlier demand must not move the table once the servo is on
    link.ask(f":Interlock:Close {axis}")
    deadline_s = clock.now_s() + CLOSE_S
    while interlock(axis, link) != acl.CLOSED:
        if clock.now_s() > deadline_s:
            cause = interlock_cause(device, axis, link)
            raise RequestRejected(
                device, f"does not close its interlock within {CLOSE_S:g} s{cause}; check the wiring of the interlock"
            )
        clock.sleep(POLL_S)
