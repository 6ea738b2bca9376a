"""The public recordings: what each is, how labctl is asked, what an independent analysis finds, what was published."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from studies.real import answers
from studies.real.answers import Answer, Commands
from studies.real.independent import cool_down, hand_turns, poses, rate_table, warm_up
from studies.real.independent.files import Found


@dataclass(frozen=True)
class Recording:
    """One recording and the two ways in which the same quantities come from it."""

    name: str
    what: str  #: the unit and how it was recorded, with its source
    asked: Callable[[Commands], Answer]
    independent: Callable[[], Found]


def _turns(name: str) -> Found:
    parts, rate_hz = hand_turns.SESSIONS[name]
    return hand_turns.analysis(parts(), rate_hz)


def _poses(name: str) -> Found:
    return poses.analysis(poses.SESSIONS[name]())


RECORDINGS = (
    Recording(
        "freeimu-warmup",
        "MPU-6050 at rest, warming up from 10 to 29 deg C in 36 min (Mike S, mjs513/FreeIMU-Updates, MIT)",
        partial(answers.at_rest, name="freeimu-warmup.parquet", map_name="freeimu-warmup"),
        warm_up.analysis,
    ),
    Recording(
        "pan-cooldown",
        "MEMS unit at rest in a cold chamber, 25 bursts in 2 h (Pathfinder for Autonomous Navigation, psim, MIT)",
        partial(answers.at_rest, name="pan-cooldown.parquet", map_name="pan-cooldown"),
        cool_down.analysis,
    ),
    *(
        Recording(
            name,
            f"{what}: six rests, one turn by 360 deg about each axis by hand (MaD-Lab Erlangen, imucal, MIT)",
            partial(answers.by_turns, name=f"{name}.parquet", map_name=name),
            partial(_turns, name),
        )
        for name, what in (
            ("imucal-annotated", "MEMS unit in raw words"),
            ("imucal-session", "another MEMS unit in deg/s"),
        )
    ),
    Recording(
        "xsens",
        "Xsens MTi in 38 poses, turned by hand (A. Pretto, imu_tk, BSD)",
        lambda commands: answers.in_poses(commands, "xsens_gyro.parquet", "xsens", "xsens_acc.parquet"),
        partial(_poses, "xsens"),
    ),
    *(
        Recording(
            f"mpu9150-{unit}",
            f"MPU-9150, unit {unit + 1} of three, in 17 to 19 poses, turned by hand (A. Mikov, imu-calib, MIT)",
            partial(answers.in_poses, name=f"mpu9150-{unit}.parquet", map_name="mpu9150"),
            partial(_poses, f"mpu9150-{unit}"),
        )
        for unit in range(3)
    ),
    Recording(
        "osu-rate-table",
        "fibre-optic gyro on a heated rate table, 695 dwells (Ohio State Underwater Robotics, numbers only)",
        partial(answers.on_rate_table, name="osu-rate-table.csv", map_name="osu-rate-table"),
        rate_table.analysis,
    ),
)
