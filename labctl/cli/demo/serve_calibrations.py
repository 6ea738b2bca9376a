"""The end of the demo: the service is started, and every calibration fetched back by serial number and applied."""

from __future__ import annotations

import subprocess
import sys

import httpx
import numpy as np

from labctl.cli.demo.runner import DemoRunner
from labctl.compensator import Compensator

READY_S = 60.0


def play(demo: DemoRunner, serials: list[str]) -> None:
    """Serve the demo's database on a free loopback port and load from it what a robot would load."""
    demo.title("Served over HTTP, fetched back and applied")
    command = [sys.executable, "-m", "labctl", "serve", "--port", "0", "--json", "--database", demo.store.location]
    demo.store.close()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as service:  # noqa: S603  our own command
        try:
            url = _address(service)
            with httpx.Client(base_url=url, timeout=READY_S) as client:
                for serial in serials:
                    answer = client.get(f"/api/units/{serial}/calibration")
                    answer.raise_for_status()
                    compensator = Compensator.from_bytes(answer.content)
                    middle = float(np.mean(compensator.calibration.temperature_c))
                    corrected, _ = compensator.step(np.full(len(compensator.axes), 50.0), middle)
                    rates_text = ", ".join(
                        f"{axis} {rate:.4f}" for axis, rate in zip(compensator.axes, corrected, strict=True)
                    )
                    demo.say(
                        f"GET /api/units/{serial}/calibration: version {compensator.calibration.version}, "
                        f"{len(answer.content)} bytes; an output of 50 deg/s at {middle:.0f} deg C is {rates_text} "
                        "deg/s"
                    )
        finally:
            service.terminate()
            service.wait(READY_S)


def _address(service: subprocess.Popen[str]) -> str:
    assert service.stdout is not None
    for line in service.stdout:
        if '"url"' in line:
            return line.split('"')[3]
    raise RuntimeError(
        "the service of the demo ended before it was ready; run `labctl serve --simulate` to see the error message"
    )
