"""What a driver of each kind must do beside what every driver must: limits, values, times."""

from __future__ import annotations

import numpy as np

from instruments.conformance.checks import Failed, require
from instruments.conformance.stand import Stand
from instruments.errors import LimitError

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
    wanted = 4 * gyro.sample_rate_hz
    require(abs(len(times) - wanted) <= 3, f"{len(times)} readings arrived in 4 s; at least {wanted:g} are expected")
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


OF_KIND = {
    "table": (refuses_a_rate_beyond_its_limit, turns_and_comes_to_rest),
    "chamber": (refuses_a_set_point_beyond_its_limits, reads_back_its_set_point),
    "reference": (reads_every_quantity,),
    "gyro": (gives_whole_numbers_at_rising_times, sees_the_rate_of_the_table),
}
