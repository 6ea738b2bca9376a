"""Runs the checks of a driver, each on a fresh bench."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple, NoReturn

import numpy as np

from instruments.bench_config import BenchFile
from instruments.conformance.stand import Kind, Stand, kind_of, open_stand, place_of
from instruments.errors import InstrumentError, LimitError, LinkError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.reference import Reference
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable
from instruments.plugins import summary

PROTOCOLS: dict[Kind, type] = {
    "table": RateTable, "chamber": Chamber, "reference": Reference, "supply": Supply, "gyro": Gyro
}  # fmt: skip
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
            parameters = list(inspect.signature(member).parameters)[1:]
            own_parameters = list(inspect.signature(getattr(stand.driver, name)).parameters)
            require(
                own_parameters == parameters,
                f"{driver.__name__}.{name} takes {own_parameters}; {protocol.__name__} says {parameters}",
            )


def sends_nothing_when_it_is_made(stand: Stand) -> None:
    """Check that no time has passed: nothing was sent, and nothing waited for."""
    require(stand.clock.now_s() == 0, f"the constructor waited {stand.clock.now_s():g} s; open ports at first use")


def says_who_it_is(stand: Stand) -> None:
    """Check the identity."""
    identity = stand.driver.identify()
    if stand.kind == "gyro":
        stated_serial = next(gyro.serial for gyro in stand.file.gyros if gyro.name == stand.driver.name)
        require(
            identity.serial == stated_serial,
            f"identify() returns the serial number {identity.serial!r}, but the bench file gives {stated_serial!r}",
        )
        require(identity.technology in ("fog", "mems", "piezo"), f"technology {identity.technology!r} is not known")
    else:
        require(isinstance(identity, str) and identity, f"identify gives {identity!r}; return a text")


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


#: A simulated unit may be off by this share, and by so many deg/s.
WRONG_SHARE, WRONG_DPS = 0.1, 3.0
TURN_DPS, TURN_S = 20.0, 6.0


def refuses_a_rate_beyond_its_limit(stand: Stand) -> None:
    """Check that nothing moves at a rate beyond the limit."""
    limit_dps = stand.driver.limits.max_rate_dps
    try:
        stand.driver.spin(1.01 * limit_dps, 1.0)
    except LimitError:
        require(not stand.driver.is_moving(), "the table moves after a rate beyond its limit was refused")
        return
    raise Failed(
        f"spin({1.01 * limit_dps:g}) was accepted, but {1.01 * limit_dps:g} deg/s is beyond max_rate_dps = "
        f"{limit_dps:g} deg/s; raise LimitError before a byte is sent"
    )


def turns_and_comes_to_rest(stand: Stand) -> None:
    """Check a run at constant rate: its rate, its angle, and that the table is at rest after it."""
    table, clock = stand.driver, stand.clock
    table.home()
    wanted_dps = table.achievable_dps(min(TURN_DPS, table.limits.max_rate_dps))
    for rate_dps in (wanted_dps, -wanted_dps):
        spin = table.spin(rate_dps, TURN_S)
        require(
            abs(spin.rate_dps - rate_dps) < 0.01 * abs(rate_dps), f"spin({rate_dps:g}) reports {spin.rate_dps:g} deg/s"
        )
        require(spin.steady_until_s - spin.steady_from_s >= TURN_S - 1e-6, f"the rate is not steady for {TURN_S:g} s")
        require(table.is_moving(), "is_moving() returns False during a run")
        table.settle(spin)
        require(not table.is_moving(), "is_moving() returns True after settle()")
    before_s = clock.now_s()
    table.stop()
    table.stop()
    require(clock.now_s() - before_s < 60, "stop of a table at rest takes longer than 60 s")


def refuses_a_set_point_beyond_its_limits(stand: Stand) -> None:
    """Check that the set point stays where it is."""
    before_c = stand.driver.read().setpoint_c
    for wrong_c in (stand.driver.limits.max_c + 1, stand.driver.limits.min_c - 1):
        try:
            stand.driver.set_temperature_c(wrong_c)
        except LimitError:
            continue
        raise Failed(
            f"set_temperature_c({wrong_c:g}) was accepted, but {wrong_c:g} deg C is beyond the limits "
            "of the driver; raise LimitError before a byte is sent"
        )
    now_c = stand.driver.read().setpoint_c
    require(
        now_c == before_c,
        f"the set point is {now_c:g} deg C after two refused requests, but it was {before_c:g} deg C before",
    )


def reads_back_its_set_point(stand: Stand) -> None:
    """Check a new set point, and the safe one."""
    chamber = stand.driver
    wanted_c = 0.5 * (max(chamber.limits.min_c, 0.0) + min(chamber.limits.max_c, 60.0))
    given_c = chamber.set_temperature_c(wanted_c)
    read = chamber.read()
    require(
        abs(given_c - wanted_c) <= chamber.limits.resolution_c, f"set point {wanted_c:g} is read back as {given_c:g}"
    )
    require(
        abs(read.setpoint_c - given_c) < 1e-6,
        f"read() returns the set point {read.setpoint_c:g} deg C, but {given_c:g} deg C was set",
    )
    require(
        abs(chamber.make_safe() - chamber.safe_c) <= chamber.limits.resolution_c,
        "after make_safe() the set point is not safe_c",
    )


def gives_whole_numbers_at_rising_times(stand: Stand) -> None:
    """Check channels, types, number and times of readings."""
    gyro = stand.driver
    gyro.start()
    parts = [gyro.read(1.0) for _ in range(4)]
    times = np.concatenate([part.t_s for part in parts])
    require(np.all(np.diff(times) > 0), "the times of the readings do not increase")
    expected = 4 * gyro.sample_rate_hz
    require(
        abs(len(times) - expected) <= 3, f"{len(times)} readings arrived in 4 s; at least {expected:g} are expected"
    )
    names = {channel.name for channel in gyro.channels}
    for part in parts:
        require(set(part.raw) == names, f"readings have {sorted(part.raw)}, the channels are {sorted(names)}")
        for name, values in part.raw.items():
            require(
                values.dtype == np.int64, f"raw {name} is {values.dtype}; give the whole numbers that were sent, int64"
            )
        require(part.valid.dtype == bool and part.valid.all(), "readings at rest are not all valid")
    newest = gyro.read_latest()
    age_s = stand.clock.now_s() - float(newest.t_s[0])
    require(len(newest) == 1, f"read_latest gives {len(newest)} readings; it must give one")
    require(age_s <= 2 / gyro.sample_rate_hz + 0.1, f"read_latest gives a reading that is {age_s:g} s old")


def sees_the_rate_of_the_table(stand: Stand) -> None:
    """Check sign and scale of the first axis on the turning table, one of the axes being vertical."""
    gyro, table = stand.driver, stand.bench.table
    limits = gyro.limits
    require(
        limits.max_rate_dps > 0 and limits.min_c < limits.max_c,
        f"the limits {limits} are not a range: the lower limit must be below the upper",
    )
    if table is None:
        return
    gyro.start()
    table.home()
    rate_dps = table.achievable_dps(min(TURN_DPS, limits.max_rate_dps, table.limits.max_rate_dps))
    channel = next((each for each in gyro.channels if each.name == "gyro_z" and each.unit == "deg/s"), None)
    if channel is None:
        return  # an analog gyro; or one without z, the axis that points up at the start
    means = []
    for asked_dps in (rate_dps, -rate_dps):
        spin = table.spin(asked_dps, TURN_S)
        gyro.read_latest()
        readings = gyro.read(TURN_S - 2.0)
        table.settle(spin)
        means.append(float(channel.value(readings.raw[channel.name]).mean()))
    half = 0.5 * (means[0] - means[1])
    wrong_dps = WRONG_SHARE * rate_dps + WRONG_DPS / 10
    require(
        abs(half - rate_dps) < wrong_dps,
        f"gyro_z follows a table rate of {rate_dps:g} deg/s by {half:.4g} deg/s; check sign and scale of the channel",
    )


def reads_every_quantity(stand: Stand) -> None:
    """Check that a reading has a whole number for each channel, and the time of the reply."""
    reference, clock = stand.driver, stand.clock
    before_s = clock.now_s()
    state = reference.read()
    names = {channel.name for channel in reference.channels}
    require(set(state.raw) == names, f"a reading has {sorted(state.raw)}, the channels are {sorted(names)}")
    require(all(isinstance(value, int) for value in state.raw.values()), "raw readings are not whole numbers")
    require(
        before_s <= state.t_s <= clock.now_s(), f"a reading of {before_s:g} s or later has the time {state.t_s:g} s"
    )


def refuses_a_voltage_beyond_its_limits(stand: Stand) -> None:
    """Check that the voltage of the units stays where it is."""
    supply = stand.driver
    before = supply.read().raw
    for wrong_v in (supply.limits.max_v + 0.1, supply.limits.min_v - 0.1):
        try:
            supply.set_voltage_v(wrong_v)
        except LimitError:
            continue
        raise Failed(
            f"set_voltage_v({wrong_v:g}) was accepted, but {wrong_v:g} V is beyond min_v or max_v of the bench file; "
            "raise LimitError before a byte is sent"
        )
    require(
        all(abs(supply.read().raw[name] - value) <= 100 for name, value in before.items()),
        "the voltage changed although it was refused",
    )


def reaches_its_voltage_and_its_safe_state(stand: Stand) -> None:
    """Check a voltage, its read-back and its measurement, then the safe state and the output switched off."""
    supply, clock = stand.driver, stand.clock
    channel = supply.channels[0]
    for wanted_v in (supply.limits.min_v, supply.limits.max_v):
        set_v = supply.set_voltage_v(wanted_v)
        require(abs(set_v - wanted_v) < supply.limits.tolerance_v, f"set_voltage_v({wanted_v:g}) returns {set_v:g} V")
        clock.sleep(1.0)
        measured_v = channel.offset + channel.scale * supply.read().raw[channel.name]
        require(
            abs(measured_v - wanted_v) < supply.limits.tolerance_v,
            f"{measured_v:g} V was measured 1 s after set_voltage_v({wanted_v:g})",
        )
    require(supply.is_on(), "is_on() returns False after set_voltage_v")
    safe_v = supply.make_safe()
    wanted_v = 0.0 if supply.safe_state == "off" else supply.limits.nominal_v
    require(abs(safe_v - wanted_v) < supply.limits.tolerance_v, f"make_safe() returns {safe_v:g} V, not {wanted_v:g} V")
    supply.switch_off()
    require(not supply.is_on(), "is_on() returns True after switch_off()")


OF_KIND = {
    "table": (refuses_a_rate_beyond_its_limit, turns_and_comes_to_rest),
    "chamber": (refuses_a_set_point_beyond_its_limits, reads_back_its_set_point),
    "reference": (reads_every_quantity,),
    "supply": (refuses_a_voltage_beyond_its_limits, reaches_its_voltage_and_its_safe_state, reads_every_quantity),
    "gyro": (gives_whole_numbers_at_rising_times, sees_the_rate_of_the_table),
}


Check = Callable[[Stand], None]


class Outcome(NamedTuple):
    """Outcome of one check: what the driver must do, and what it does instead (empty: the check passed)."""

    check: str
    problem: str


def checks_of(name: str) -> tuple[Check, ...]:
    """Return the checks of a driver; raises PluginError for one that is not installed."""
    return (*COMMON, *OF_KIND[kind_of(name)])


def try_driver(name: str, file: BenchFile | None = None) -> Iterator[Outcome]:
    """Yield the outcome of each check of a driver, on the given bench or on that of `place_of`.

    Raises PluginError for a driver that is not installed or cannot be loaded, ValueError where no simulated bench has
    it.
    """
    file = place_of(name) if file is None else file
    for check in checks_of(name):
        yield Outcome(check.__name__.replace("_", " "), _problem(check, name, file))


def _problem(check: Check, name: str, file: BenchFile) -> str:
    stand = open_stand(name, file)
    try:
        check(stand)
        stand.bench.close()
    except Failed as failure:
        return str(failure)
    except InstrumentError as error:
        return f"raised {type(error).__name__} in a normal situation: {error}"
    except Exception as error:  # noqa: BLE001  a driver of another package may raise anything
        return f"raised {summary(error)}; every failure of a driver must be an InstrumentError"
    return ""
