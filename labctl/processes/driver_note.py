"""The note beside the database that says which process drives a bench: `labctl stop` reads it without a database."""

from __future__ import annotations

import os

from labctl.log import get_logger
from labctl.processes.settings import STOP, BenchSettings
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.local_bench import LocalBench
from labctl.stop.places import DriverNote, ProcessId, place_of
from labctl.store import Store

log = get_logger()


class DriverNoteWriter:
    """Writes the note of one bench process; nothing for a service without a bench."""

    def __init__(self, settings: BenchSettings, store: Store, local: LocalBench) -> None:
        self._bench = local.bench
        self._socket = settings.folder / STOP
        self._place = None if self._bench is None else place_of(store.location, self._bench.name)

    def write(self, settings: BenchSettings) -> None:
        """Write who drives the bench, and its guardian by the settings of the supervisor."""
        if self._bench is None:
            return
        guardian = ProcessId.of(settings.guardian_pid) if settings.guardian_pid else ProcessId()
        self._write(
            DriverNote(
                self._bench.name, ProcessId.of(os.getpid()), str(self._socket), guardian, settings.guardian_socket,
                self._bench.is_simulated, self._bench.model_dump(mode="json"),
            )
        )  # fmt: skip

    def write_left(self, left: BenchLeft) -> None:
        """Write how the bench was left at the end of this process."""
        if self._bench is None:
            return
        text = left.text or f"bench {self._bench.name} was left at rest"
        self._write(
            DriverNote(
                self._bench.name, simulated=self._bench.is_simulated, document=self._bench.model_dump(mode="json"),
                left=text, left_safe=not left.unconfirmed,
            )
        )  # fmt: skip

    def _write(self, note: DriverNote) -> None:
        if self._place is None:
            return
        try:
            self._place.write_note(note)
        except OSError as error:  # a stop still finds the latch, and the instruments by the bench file
            log.error("driver_note.unwritable", bench=note.bench, error=str(error))
