"""A stream by the driver of a gyro: of a bench file, or of a driver with its options."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from instruments.bench import open_bench
from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.configuration import configuration_of
from instruments.interfaces.gyro import Readings
from instruments.simulation import lay_simulated
from instruments.transport.factory import Wire
from labctl.answers.wire_logs import RecordedSession
from labctl.errors import BadInput
from labctl.fitting.live import PoseRequest
from labctl.recording import RecordingInfo
from labctl.recording.columns import ARRIVAL_S, BY_NAME, DEVICE_S
from labctl.services.benches.standards import standards_of
from labctl.services.benches.wire_log import recording
from labctl.services.live.source import Block
from labctl.services.planning.loading import with_drivers
from labctl.services.recordings.importers import parsed_options

#: Limits of a unit that is named by driver and port alone: no table turns it.
USUAL_RATE_DPS = 2000.0


class GyroSource:
    """One gyro of a bench. Table and chamber of the bench are not touched."""

    def __init__(self, bench: BenchFile, serial: str | None, clock: Clock, wire: Wire | None = None) -> None:
        """Choose a gyro by its serial number, default the first. Raises BadInput for an unknown one."""
        chosen = [each for each in bench.gyros if serial in (None, each.serial)]
        if not chosen:
            known = ", ".join(each.serial for each in bench.gyros)
            raise BadInput(f"{serial}: bench {bench.name} has no such unit; choose one of {known}")
        self._settings = chosen[0]
        # the simulated world and the seed of a unit do not depend on the other units of the bench
        self._bench_file = bench.model_copy(update={"table": None, "chamber": None, "gyros": (self._settings,)})
        self._bench = open_bench(self._bench_file.model_copy(update={"references": ()}), clock, wire=wire)
        self._gyro = self._bench.gyros[self._settings.name]
        self.clock = clock
        self.is_simulated = bench.is_simulated
        self._first_s: float | None = None
        self.serial = self._settings.serial
        self.name = f"{self._settings.name} on {self._settings.port or self._settings.host}"

    def start(self) -> RecordingInfo:
        """Start the stream; raises InstrumentError, BadInput for a unit without an accelerometer."""
        gyro, settings = self._gyro, self._settings
        self._require_force([channel.name for channel in gyro.channels])
        if self._bench.simulation is not None:
            self._bench.unit_handler.power(True)
        identity = gyro.identify()
        gyro.start()
        conventions = {k: v for k, v in settings.datasheet_conventions.items() if k in identity.datasheet}
        return RecordingInfo.model_validate({
            "serial": identity.serial, "model": identity.model, "axes": gyro.axes, "kind": "samples",
            "motion": "poses", "started_at": self.clock.utc(), "latitude_deg": self._bench_file.latitude_deg,
            "sample_rate_hz": gyro.sample_rate_hz, "max_rate_dps": gyro.limits.max_rate_dps,
            "technology": identity.technology or None, "datasheet": dict(identity.datasheet),
            "datasheet_conventions": conventions,
            "output": {axis: dict(output_unit) for axis, output_unit in identity.output.items()},
            "configuration": configuration_of(identity.reported),
            "standards": standards_of(self._bench_file), "notes": "turned by hand, live",
        })  # fmt: skip

    def _require_force(self, channels: Sequence[str]) -> None:
        if absent := [name for axis in "xyz" for name in (f"gyro_{axis}", f"accel_{axis}_g") if name not in channels]:
            raise BadInput(
                f"{self.name}: driver {self._settings.driver} gives no {', '.join(absent)}; a live calibration "
                "compares the turns of all three axes with gravity, so the stream needs gyros and accelerometers about "
                "x, y and z. Turn a unit without accelerometers by known angles: labctl campaign start by-hand"
            )

    def read(self, duration_s: float) -> Block:
        """Read the gyro; raises InstrumentError, also where it has gone silent."""
        readings = self._gyro.read(duration_s)
        if not len(readings):
            return Block(lost=readings.lost, damaged=readings.damaged)
        if self._first_s is None:
            self._first_s = float(readings.t_s[0])
        return Block(self._columns(readings), readings.lost, readings.damaged)

    def _columns(self, readings: Readings) -> dict[str, NDArray[np.generic]]:
        begun_s = self._first_s or 0.0
        columns: dict[str, NDArray[np.generic]] = {"t_s": readings.t_s - begun_s}
        if readings.device_s is not None:
            columns[DEVICE_S] = readings.device_s
        if readings.arrival_s is not None:
            columns[ARRIVAL_S] = readings.arrival_s - begun_s
        for channel in self._gyro.channels:
            if channel.name in BY_NAME:
                columns[channel.name] = channel.value(readings.raw[channel.name])
        return columns | {"valid": readings.valid.astype(np.int64)}

    def ask(self, request: PoseRequest | None) -> None:
        """Have the simulated person of a simulated bench do it; at a real one a person reads it."""
        if self._bench.simulation is not None and request is not None:
            lay_simulated(self._bench.simulation, self.clock, request.pose.up)

    def stop(self) -> None:
        """Close the ports."""
        self._bench.close()


@contextmanager
def recorded_source(bench: BenchFile, serial: str | None, clock: Clock, wire_log: Path | None) -> Iterator[GyroSource]:
    """Yield a gyro of a bench; `wire_log` gets every byte between labctl and it. Raises BadInput as GyroSource does."""
    with recording(wire_log, bench, clock, RecordedSession(kind="live", unit=serial or "")) as log:
        yield GyroSource(bench, serial, clock, None if log is None else log.wire)


def bench_of_driver(
    driver: str, port: str, serial: str, options: Sequence[str], latitude_deg: float | None
) -> BenchFile:
    """Return a bench of one gyro: its driver, its port, and options KEY=VALUE of the driver's section.

    Raises BadInput for an option, BadBench for a setting that the driver does not take.
    """
    section: dict[str, object] = {
        "name": "unit", "driver": driver, "port": port, "serial": serial, "axes": ["x", "y", "z"],
        "max_rate_dps": USUAL_RATE_DPS,
    }  # fmt: skip
    section |= parsed_options(options)
    try:
        bench = BenchFile.model_validate({"name": "live", "latitude_deg": latitude_deg, "gyros": [section]})
    except ValidationError as error:
        first = error.errors()[0]
        raise BadInput(f"{'.'.join(map(str, first['loc'][2:])) or 'options'}: {first['msg']}; correct it") from error
    return with_drivers(bench)
