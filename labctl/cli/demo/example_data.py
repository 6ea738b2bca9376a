"""(c) The published table of the Gyrostar, and (d) the recording of a real fibre-optic gyro."""

from __future__ import annotations

from instruments.clock import VirtualClock
from labctl.cli.demo.runner import DemoRunner
from labctl.services.recordings.examples import example
from labctl.services.recordings.transfer import import_folder


def play(stage: DemoRunner) -> None:
    """Import both and fit them."""
    stage.title("(c) Vibrating gyro: the published table of the Weiss report")
    table = import_folder(stage.store, example("weiss-gyrostar"), VirtualClock().utc())
    stage.fit(table.serial, "weiss1995", table.recording)
    stage.title("(d) A real fibre-optic gyro: 695 dwells on a heated rate table (Ohio State Underwater Robotics)")
    real = import_folder(stage.store, example("osu-fog"), VirtualClock().utc())
    stage.say(f"imported as points: {real.datasets} data sets")
    answer = stage.fit(real.serial, "ojeda2000", real.recording)
    stage.figures["real_fog"] = answer.error.model_dump()
