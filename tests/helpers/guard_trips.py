"""A bench on which all is well, and for each guard a change that trips it."""

from __future__ import annotations

from procedures.monitoring.bench_snapshot import BenchSnapshot, ReadingCounts

WELL = BenchSnapshot(
    t_s=100.0,
    chamber_c=20.0,
    setpoint_c=20.0,
    gyro_c={"imu": 22.0},
    silent_s={"imu": 1.0, "chamber": 9.0},
    taking_readings=True,
    asked_dps=100.0,
    rate_dps=100.001,
    counts={"imu": ReadingCounts(expected=1000, valid=990, invalid=5, damaged=5)},
)

#: Guard, change of the bench, and what the trip says: device, value, limit, unit.
TRIPS = [
    ("chamber_limits", {"chamber_c": 152.5, "setpoint_c": 152.5}, "chamber", 152.5, 152.0, "deg C"),
    ("unit_air", {"chamber_c": -42.5, "setpoint_c": -42.5}, "chamber", -42.5, -42.0, "deg C"),
    ("unit_temperature", {"gyro_c": {"imu": 100.5}}, "imu", 100.5, 100.0, "deg C"),
    ("chamber_deviation", {"chamber_c": 17.5}, "chamber", 2.5, 2.0, "deg C"),
    ("chamber_alarm", {"alarms": ("over-temperature",)}, "chamber", 1.0, 0.0, ""),
    ("foreign_change", {"foreign": ("the set point is 27 deg C, labctl gave 20 deg C",)}, "chamber", 1.0, 0.0, ""),
    ("stale", {"silent_s": {"imu": 31.0}}, "imu", 31.0, 30.0, "s"),
    ("damaged_readings", {"counts": {"imu": ReadingCounts(1000, damaged=30)}}, "imu", 3.0, 2.0, "%"),
    ("invalid_readings", {"counts": {"imu": ReadingCounts(1000, invalid=600)}}, "imu", 60.0, 50.0, "%"),
    ("rate", {"rate_dps": 98.5}, "table", 1.5, 1.0, "deg/s"),
    ("unit_off_air", {"gyro_c": {"imu": 45.0}}, "imu", 25.0, 20.0, "deg C"),
]
