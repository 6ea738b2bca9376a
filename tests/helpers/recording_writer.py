"""A process that writes to a database as a bench process does: `python -m tests.helpers.recording_writer DATABASE`.

It takes words of ACTS from its standard input, one a line, and writes "done" after each.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from instruments.interfaces.gyro import Readings
from labctl.store import Store
from labctl.store.connection.database import Database
from labctl.store.repositories.sample_blocks import channels_of
from procedures.contracts.journal import DataSetHeader, DataSetState, EnvironmentSample
from procedures.contracts.steps import Acquire
from tests.helpers.paths import ROOT
from tests.helpers.recordings import points

#: The campaign that is changed, and the unit of the bench single-axis-sim.
CAMPAIGN, GYRO = 1, "fog"


def _append(store: Store) -> None:
    """Measure one more data set, of ten readings."""
    begin_s = float(store.recordings.data_sets(CAMPAIGN)[-1].t_until_s or 0.0) + 60.0
    journal = store.campaigns.journal(CAMPAIGN)
    number = journal.dataset_opened(_header(store, begin_s))
    with store._database.reading() as connection:
        channels = [each["name"] for each in channels_of(connection, CAMPAIGN)]
    readings = Readings(
        begin_s + np.arange(10.0), {name: np.full(10, 7, dtype=np.int64) for name in channels}, np.ones(10, dtype=bool)
    )
    journal.readings(number, GYRO, readings, 25.0)
    journal.dataset_closed(number, DataSetState.COMPLETE)


def _header(store: Store, begin_s: float) -> DataSetHeader:
    step = next(Acquire.model_validate(row.body) for row in store.campaigns.steps(CAMPAIGN) if row.kind == "acquire")
    return DataSetHeader(step, step.rate_dps, step.rate_dps, begin_s, begin_s + 10.0, 0.0, 25.0, step.run, (GYRO,))


def _import_another(store: Store) -> None:
    rates = np.linspace(-9.0, 9.0, 7)
    other = points(rates, np.full(7, 25.0), rates)
    store.recordings.add_import(other, other.info.started_at)


ACTS: Mapping[str, Callable[[Store], object]] = {
    "append": _append,
    "environment": lambda store: store.campaigns.journal(CAMPAIGN).environment(
        EnvironmentSample(1e6, 1, 25.0, 25.0, {GYRO: 25.0})
    ),
    "correct rates": lambda store: store.campaigns.journal(CAMPAIGN).step_clock(80.0, 5, lambda _: 1.001),
    "correct rates again": lambda store: store.campaigns.journal(CAMPAIGN).step_clock(80.0, 5, lambda _: 1.001),
    "withdraw": lambda store: store.campaigns.journal(CAMPAIGN).dataset_closed(2, DataSetState.PARTIAL, "touched"),
    "import another": _import_another,
}


class Writer:
    """The process, asked for one act after the other."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def carry_out(self, act: str) -> None:
        """Return when an act is in the database."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(act, file=self._process.stdin, flush=True)
        assert self._process.stdout.readline() == "done\n", act


@contextmanager
def another_process(database: Path) -> Iterator[Writer]:
    """Run the process for a while; it has the writing connection of the database."""
    words = [sys.executable, "-m", "tests.helpers.recording_writer", str(database)]
    with subprocess.Popen(words, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield Writer(process)
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait() == 0


def main() -> None:
    """Carry out what is asked for until the input ends."""
    store = Store(Database(sys.argv[1], write=True))
    for line in sys.stdin:
        ACTS[line.strip()](store)
        sys.stdout.write("done\n")
        sys.stdout.flush()
    store.close()


if __name__ == "__main__":
    main()
