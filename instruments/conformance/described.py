"""A described instrument tried on itself, or on whatever answers for it: every request of its description, in order.

Without `move` only questions are sent: nothing turns, heats or cools.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from typing import NamedTuple

import numpy as np

from instruments.clock import Clock
from instruments.drivers.line_reference import LineReference
from instruments.drivers.request_reply.chamber import DescribedChamber
from instruments.drivers.request_reply.dialogue import Dialogue
from instruments.drivers.request_reply.table import DescribedTable
from instruments.errors import InstrumentError
from instruments.protocols.request_reply.chamber import ChamberDescription
from instruments.protocols.request_reply.parts import Ask, AskAlarms, AskNumber, AskState, AskText
from instruments.protocols.request_reply.reference import ReferenceDescription
from instruments.protocols.request_reply.settings import DescribedChamberSettings, DescribedTableSettings
from instruments.protocols.request_reply.table import TableDescription
from instruments.protocols.text_lines.reference_lines import LineReferenceSettings
from instruments.transport.factory import Ports, Wire

#: A table is tried at this rate, deg/s, and acceleration, deg/s2, or at its limit, steady for so long, s.
TRIED_DPS, TRIED_DPS2, TRIED_S = 10.0, 20.0, 2.0
#: A table that was stopped stands by then, s, beside its ramp.
STOPPED_WITHIN_S, POLL_S = 5.0, 0.1

Described = TableDescription | ChamberDescription | ReferenceDescription
Step = tuple[str, Callable[[], str]]


class Tried(NamedTuple):
    """One request, or one action: what was tried, what was answered, and what was wrong (empty: nothing)."""

    what: str
    answer: str
    problem: str


def requests_of(description: Described) -> list[tuple[str, str]]:
    """Return the key and the text of every request that a description can send."""
    requests: list[tuple[str, str]] = []
    for key in type(description).model_fields:
        ask = getattr(description, key)
        if isinstance(ask, Ask):
            requests.append((key, ask.send))
        elif isinstance(ask, tuple):
            requests += [(key, each) for each in ask]
    if isinstance(description, ReferenceDescription):
        requests += [("identity", description.identity)] if description.identity else []
        requests += [(f"quantities.{name}", quantity.ask) for name, quantity in description.quantities.items()]
    if description.line.check is not None:
        requests.append(("line.check", description.line.check.send))
    return requests


def try_description(
    description: Described, address: dict[str, object], clock: Clock, *, move: bool = False, wire: Wire | None = None
) -> Iterator[Tried]:
    """Yield what each request of a description gives. `address`: port, or host and tcp_port, as in a bench file;
    `wire` records what passes.

    `move` also sends the commands: a table homes, turns both ways and is stopped; a chamber's set point is moved by its
    resolution and back. Raises pydantic.ValidationError for an address that is none.
    """
    section: dict[str, object] = {"driver": "described", "format": description, **address}
    steps, close = _steps(description, section, clock, Ports(clock, wire=wire), move=move)
    try:
        for step_name, act in steps:
            try:
                yield Tried(step_name, act(), "")
            except InstrumentError as error:
                yield Tried(step_name, "", str(error))
    finally:
        close()


def _steps(
    description: Described, section: dict[str, object], clock: Clock, ports: Ports, *, move: bool
) -> tuple[list[Step], Callable[[], None]]:
    if isinstance(description, TableDescription):
        limits = {
            "max_rate_dps": description.max_rate_dps,
            "acceleration_dps2": min(TRIED_DPS2, description.max_acceleration_dps2),
        }
        table = DescribedTable(DescribedTableSettings.model_validate({**limits, **section}), ports, clock)
        actions = _turns(table, clock) if move else []

        def leave() -> None:
            with closing(table), suppress(InstrumentError):
                if move:
                    table.stop()

        return [*_questions(description, table.dialogue), *actions], leave
    if isinstance(description, ChamberDescription):
        safe_c = min(max(25.0, description.min_c), description.max_c)
        within = {"min_c": description.min_c, "max_c": description.max_c, "safe_c": safe_c}
        chamber = DescribedChamber(DescribedChamberSettings.model_validate({**within, **section}), ports, clock)
        actions = [("set", lambda: _moved_set_point(chamber))] if move else []

        def give_back() -> None:
            with closing(chamber), suppress(InstrumentError):
                if move:
                    chamber.dialogue.command(description.end, "end remote operation")

        return [*_questions(description, chamber.dialogue), *actions], give_back
    document = description.model_dump(exclude_unset=True)
    readout = LineReference(LineReferenceSettings.model_validate({**section, "format": document}), ports, clock)
    return [("identity", readout.identify), ("quantities", lambda: _quantities(readout))], readout.close


def _questions(description: Described, dialogue: Dialogue) -> list[Step]:
    questions: list[Step] = []
    for key in type(description).model_fields:
        ask = getattr(description, key)
        if isinstance(ask, Ask):
            questions.append((key, _answer(dialogue, key, ask)))
    if description.line.check is not None:
        questions.append(("line.check", _answer(dialogue, "line.check", description.line.check)))
    return questions


def _answer(dialogue: Dialogue, key: str, ask: Ask) -> Callable[[], str]:
    answer_name = f"answer [{key}]"
    if isinstance(ask, AskState):
        return lambda: "yes" if dialogue.holds(ask, answer_name) else "no"
    if isinstance(ask, AskNumber):
        return lambda: f"{dialogue.number(ask, answer_name):g}"
    if isinstance(ask, AskAlarms):
        return lambda: ", ".join(dialogue.alarms(ask)) or "none"
    if isinstance(ask, AskText) and key == "identity":
        return lambda: dialogue.identity(ask)
    return lambda: dialogue.text(ask, answer_name)


def _turns(table: DescribedTable, clock: Clock) -> list[Step]:
    rate_dps = min(TRIED_DPS, table.limits.max_rate_dps)

    def homed() -> str:
        table.home()
        return f"at {table.angle_deg():.4f} deg"

    def turned(asked_dps: float) -> str:
        spin = table.spin(asked_dps, TRIED_S)
        first = table.read_angle()
        clock.sleep(TRIED_S)
        last = table.read_angle()
        table.settle(spin)
        found_dps = (last.angle_deg - first.angle_deg) / (last.t_s - first.t_s)
        return f"{found_dps:.3f} deg/s by its position, {spin.rate_dps:g} deg/s asked for; stands again"

    def stopped() -> str:
        table.spin(rate_dps, TRIED_S)
        asked_s = clock.now_s()
        table.stop()
        limit_s = STOPPED_WITHIN_S + rate_dps / table.limits.max_acceleration_dps2
        while table.is_moving():
            if clock.now_s() - asked_s > limit_s:
                raise InstrumentError(
                    table.name,
                    f"still turns {limit_s:.1f} s after stop was sent; switch its power off by hand, then correct "
                    "stop or [standing]",
                )
            clock.sleep(POLL_S)
        return f"stands {clock.now_s() - asked_s:.1f} s after stop"

    def stopped_first() -> str:
        table.stop()
        return "sent"

    key = "run" if table.settings.format.run else "move"
    return [
        ("stop", stopped_first), ("home", homed), (f"{key} forwards", lambda: turned(rate_dps)),
        (f"{key} backwards", lambda: turned(-rate_dps)), ("stop in a run", stopped),
    ]  # fmt: skip


def _moved_set_point(chamber: DescribedChamber) -> str:
    found_c, limits = chamber.read().setpoint_c, chamber.limits
    other_c = found_c + (limits.resolution_c if found_c + limits.resolution_c <= limits.max_c else -limits.resolution_c)
    moved_c = chamber.set_temperature_c(other_c)
    back_c = chamber.set_temperature_c(found_c)
    return f"{found_c:.2f} to {moved_c:.2f} and back to {back_c:.2f} deg C"


def _quantities(readout: LineReference) -> str:
    state = readout.read()
    return ", ".join(
        f"{channel.name} {channel.value(np.array([state.raw[channel.name]]))[0]:g} {channel.unit}"
        for channel in readout.channels
    )
