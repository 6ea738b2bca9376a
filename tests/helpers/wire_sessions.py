"""Sessions for tests/wire_logs: a short campaign on the simulated bench of each driver, recorded.

`python -m tests.helpers.wire_sessions` records those of all drivers again, with names only those; a driver whose bytes
have changed on purpose gets a new file in this way.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import tomli_w

from instruments.bench_config import BenchFile, read_bench, shipped_benches
from instruments.conformance.stand import place_of
from instruments.drivers.registry import DRIVERS
from tests.helpers.lab import Lab
from tests.helpers.paths import ROOT

FOLDER = ROOT / "tests" / "wire_logs"
SUFFIX = ".jsonl.gz"
#: A file of the folder is not larger.
MAX_BYTES = 60_000
RECIPE = """\
format = "labctl-recipe/1"
name = "wire-log"
temperatures_c = [27]
rates_dps = [-20, 20]
positions = ["z"]

[soak]
hold_s = 5
max_drift_c = 20.0
drift_window_s = 2

[acquire]
duration_s = 2
settle_s = 1
"""


def own_drivers() -> list[str]:
    """Return the names of the drivers that come with labctl."""
    return [name for name in DRIVERS.names if DRIVERS.plugin(name).is_own]


def bench_of(driver: str) -> BenchFile:
    """Return a simulated bench with a table that uses a driver; inputs are read slowly, as every value is recorded."""
    bench = place_of(driver)
    if bench.table is None:
        shipped = [read_bench(name) for name in shipped_benches()]
        able = [each for each in shipped if each.is_simulated and each.table is not None and each.chamber is not None]
        bench = next(each for each in able if driver in [gyro.driver for gyro in each.gyros])
    if driver in ("nidaq", "mcc-daq"):
        record = bench.model_dump(exclude_none=True)
        (gyro,) = record["gyros"]
        gyro["sample_rate_hz"], gyro["options"]["average"] = 50, 1
        bench = BenchFile.model_validate(record)
    return bench


def record_session(driver: str, file: Path, folder: Path) -> None:
    """Record the campaign of a driver; `folder` gets bench file, recipe and database."""
    bench, recipe = folder / "bench.toml", folder / "wire-log.toml"
    document = bench_of(driver).model_dump(mode="json", exclude_none=True, exclude={"drivers", "reported"})
    bench.write_text(tomli_w.dumps(document), encoding="utf-8")
    recipe.write_text(RECIPE, encoding="utf-8")
    Lab(folder).run("campaign", "start", str(recipe), "--bench", str(bench), "--wire-log", str(file))


def main(names: list[str]) -> None:
    """Record the sessions of some drivers, or of all."""
    for driver in names or own_drivers():
        file = FOLDER / f"{driver}{SUFFIX}"
        with tempfile.TemporaryDirectory() as folder:
            record_session(driver, file, Path(folder))
        sys.stdout.write(f"{file.relative_to(ROOT)}: {file.stat().st_size} bytes\n")


if __name__ == "__main__":
    main(sys.argv[1:])
