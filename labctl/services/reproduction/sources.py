"""Where the data of a reproduction come from: a shipped recording, a simulated unit, or a unit of the database."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.error_per_turn import AT_REST_DPS
from labctl.fitting.numeric.arrays import Array
from labctl.progress import report_stage
from labctl.recording import OutputUnit, Recording, read_recording, to_points
from labctl.recording.recording import Columns
from labctl.services.recordings.examples import example
from labctl.services.recordings.loading import newest_row, source_of
from labctl.services.reproduction.findings import Origin
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from labctl.store import Store


@dataclass(frozen=True)
class Rest:
    """Readings of one data set at rest: times (n,) s from the first, and rates by axis, (n,) deg/s."""

    t_s: Array
    rate_dps: dict[str, Array]


@dataclass(frozen=True)
class Measured:
    """Data of one unit."""

    name: str  #: as the numbers' column says it
    sentence: str  #: what it is, for the page
    recording: Recording  #: one row per data set, or a table of coefficients
    rest: Rest | None  #: None where no readings at rest are kept
    number: int | None = None  #: of a recording of the database

    @property
    def origin(self) -> Origin:
        """Whether its recording says that it was simulated."""
        return "simulated" if self.recording.info.notes.startswith("simulated") else "measured"


def shipped(name: str, sentence: str) -> Measured:
    """Return an example that comes with labctl. Raises BadInput for an unknown name."""
    recording = read_recording(example(name))
    return Measured(recording.info.serial, sentence, to_points(recording), _rest_of(recording))


def simulated(recipe: str, bench: str, name: str, sentence: str, *, seed: int = 1) -> Measured:
    """Return a simulated campaign; the same seed gives the same readings."""
    return measured_from(simulated_readings(recipe, bench, seed=seed), name, sentence)


def simulated_readings(recipe: str, bench: str, *, seed: int = 1, sample_rate_hz: float | None = None) -> Recording:
    """Return the readings of a simulated campaign; default: 10 per second."""
    report_stage(f"simulate {recipe} on bench {bench}")
    return make_recording(
        SimulateRequest(recipe=recipe, bench=bench, seed=seed, sample_rate_hz=sample_rate_hz)
    ).recording


def measured_from(readings: Recording, name: str, sentence: str) -> Measured:
    """Return the data sets of readings, and their first rest."""
    return Measured(name, sentence, to_points(readings), _rest_of(readings))


def of_unit(store: Store, serial: str, recording: int | None) -> Measured:
    """Return a unit's recording, default the newest. Raises NotFound, NotEnoughData."""
    report_stage(f"read the recording of {serial}")
    row = newest_row(store, serial, recording, to_fit=True)
    source = source_of(store, row)
    points = to_points(source) if source.info.motion != "poses" else source
    rest = None
    if row.kind == "samples" and (number := _longest_rest(store, row.id)) is not None:
        rest = rest_in(store.recordings.dataset(row.id, number), points)
    description = f"Unit {serial}, recording {row.id}: {row.datasets} data sets ({points.info.model})."
    return Measured(serial, description, points, rest, row.id)


def _longest_rest(store: Store, recording: int) -> int | None:
    """Return the number of the data set at rest with the most readings; None where there is none."""
    sets = [data_set for data_set in store.recordings.data_sets(recording) if data_set.n and not data_set.verification]
    still = [each for each in sets if abs(each.table_rate_dps) <= AT_REST_DPS]
    return max(still, key=lambda each: each.n).number if still else None


def rest_in(columns: Columns, recording: Recording) -> Rest | None:
    """Return the valid readings of a data set if the table is at rest in it, else None."""
    still = recording.info.motion == "rest"  # which has no table
    if "t_s" not in columns or not (still or "table_rate_dps" in columns):
        return None
    good = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(columns["t_s"]), dtype=bool)
    if np.count_nonzero(good) < 2:
        return None
    if not still and np.abs(np.asarray(columns["table_rate_dps"], dtype=np.float64)[good]).max() > AT_REST_DPS:
        return None
    t_s = np.asarray(columns["t_s"], dtype=np.float64)[good]
    rests = {}
    for axis in recording.info.axes:
        output_unit = recording.info.output.get(axis, OutputUnit())
        rests[str(axis)] = (
            np.asarray(columns[f"gyro_{axis}"], dtype=np.float64)[good] - output_unit.offset
        ) / output_unit.scale
    return Rest(t_s - t_s[0], rests)


def _rest_of(recording: Recording) -> Rest | None:
    if recording.info.kind != "samples":
        return None
    dataset = np.asarray(recording.columns["dataset"])
    usual = np.full(len(dataset), 0.0 if recording.info.motion == "rest" else np.inf)
    rates = np.asarray(recording.columns.get("table_rate_dps", usual), dtype=np.float64)
    for number in np.unique(dataset[np.abs(rates) <= AT_REST_DPS]):
        rows = dataset == number
        if (rest := rest_in({name: v[rows] for name, v in recording.columns.items()}, recording)) is not None:
            return rest
    return None
