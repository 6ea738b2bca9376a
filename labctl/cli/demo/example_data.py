"""(a) The published table of the Gyrostar, and (b) the recording of a real fibre-optic gyro."""

from __future__ import annotations

from instruments.clock import VirtualClock
from labctl.cli.demo.runner import DemoRunner
from labctl.services.recordings.examples import example
from labctl.services.recordings.transfer import import_folder


def play(demo: DemoRunner) -> None:
    """Import both and fit them."""
    demo.title("(a) Vibrating gyro: the published table of the Weiss report")
    table = import_folder(demo.store, example("weiss-gyrostar"), VirtualClock().utc())
    demo.fit(table.serial, "weiss1995", table.recording)
    demo.title("(b) A real fibre-optic gyro: 695 dwells on a heated rate table (Ohio State Underwater Robotics)")
    real = import_folder(demo.store, example("osu-fog"), VirtualClock().utc())
    demo.say(f"imported as points: {real.datasets} data sets")
    answer = demo.fit(real.serial, "ojeda2000", real.recording)
    demo.figures["real_fog"] = answer.error.model_dump()
