"""What every driver must do. Each check gets a driver on a fresh bench and raises Failed where it does otherwise."""

from __future__ import annotations

import inspect
from typing import Literal, NoReturn

from instruments.conformance.stand import Kind, Stand
from instruments.errors import InstrumentError, LinkError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.reference import Reference
from instruments.interfaces.table import RateTable

PROTOCOLS: dict[Kind, type] = {"table": RateTable, "chamber": Chamber, "reference": Reference, "gyro": Gyro}
#: An instrument that says nothing must not hold the bench up for longer, s.
LONGEST_SILENCE_S = 60.0
TRIALS = 12


class Failed(Exception):
    """A driver that does not do what every driver must do; the text is one line."""


def require(holds: object, text: str) -> None:
    """Raise Failed unless something holds."""
    if not holds:
        raise Failed(text)


def has_every_method(stand: Stand) -> None:
    """Check that the driver has every method of its interface, with the same parameters."""
    protocol, driver = PROTOCOLS[stand.kind], type(stand.driver)
    for name, member in inspect.getmembers(protocol):
        if name.startswith("_") or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        require(hasattr(stand.driver, name), f"{driver.__name__} has no {name}; {protocol.__name__} says what it does")
        if inspect.isfunction(member):
            wanted = list(inspect.signature(member).parameters)[1:]
            given = list(inspect.signature(getattr(stand.driver, name)).parameters)
            require(given == wanted, f"{driver.__name__}.{name} takes {given}; {protocol.__name__} says {wanted}")


def sends_nothing_when_it_is_made(stand: Stand) -> None:
    """Check that no time has passed: nothing was sent, and nothing waited for."""
    require(stand.clock.now_s() == 0, f"the constructor waited {stand.clock.now_s():g} s; open ports at first use")


def says_who_it_is(stand: Stand) -> None:
    """Check the identity."""
    found = stand.driver.identify()
    if stand.kind == "gyro":
        given = next(each.serial for each in stand.file.gyros if each.name == stand.driver.name)
        require(
            found.serial == given,
            f"identify() returns the serial number {found.serial!r}, but the bench file gives {given!r}",
        )
        require(found.technology in ("fog", "mems", "piezo"), f"technology {found.technology!r} is not known")
    else:
        require(isinstance(found, str) and found, f"identify gives {found!r}; return a text")


def reports_silence(stand: Stand) -> None:
    """Check that a silent instrument is a LinkError of one line, in bounded time."""
    stand.faults.arm("silence")
    try:
        stand.ask()
    except LinkError as error:
        _is_its_own(stand, error)
    else:
        _fail(stand, "answers, but the instrument is silent; raise NoReply after a time-out")
    waited_s = stand.clock.now_s()
    require(
        waited_s < LONGEST_SILENCE_S,
        f"the driver waited {waited_s:g} s for a silent instrument; the limit is {LONGEST_SILENCE_S:g} s",
    )


def opens_a_dropped_link_again(stand: Stand) -> None:
    """Check that the instrument can be used after its link was gone."""
    stand.ask()
    stand.faults.arm("dropped_link", count=1)
    try:
        stand.ask()
    except LinkError as error:
        _is_its_own(stand, error)
    stand.ask()


def survives_a_split_reply(stand: Stand) -> None:
    """Check pieces of replies."""
    _survives(stand, "split")


def survives_noise(stand: Stand) -> None:
    """Check bytes that the instrument never sent."""
    _survives(stand, "noise")


def survives_merged_replies(stand: Stand) -> None:
    """Check output that is held back and comes at once."""
    _survives(stand, "merge")


def _survives(stand: Stand, fault: Literal["split", "noise", "merge"]) -> None:
    stand.ask()
    for _ in range(TRIALS):
        now_s = stand.clock.now_s()
        armed = stand.faults.arm(fault, from_s=now_s, until_s=now_s + 0.5, count=1, value=3)
        try:
            stand.ask()
        except InstrumentError as error:
            _is_its_own(stand, error)
        armed.count = 0
        stand.clock.sleep(1.0)
    stand.ask()


def closes_twice(stand: Stand) -> None:
    """Check that closing twice does no harm, and that the driver can be used afterwards."""
    stand.ask()
    before = stand.driver.identify()
    stand.close()
    stand.close()
    stand.ask()
    require(stand.driver.identify() == before, "identify() returns another result after the link was closed and opened")


def _is_its_own(stand: Stand, error: InstrumentError) -> None:
    name, text = stand.driver.name, str(error)
    require(error.device == name, f"an error is of device {error.device!r}; give it the driver's name, {name!r}")
    require(text.startswith(f"{name}: ") and "\n" not in text, f"the error {text!r} must be one line with the device")


def _fail(stand: Stand, text: str) -> NoReturn:
    raise Failed(f"{type(stand.driver).__name__} {text}")


COMMON = (
    has_every_method,
    sends_nothing_when_it_is_made,
    says_who_it_is,
    reports_silence,
    opens_a_dropped_link_again,
    survives_a_split_reply,
    survives_noise,
    survives_merged_replies,
    closes_twice,
)
