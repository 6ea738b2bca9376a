"""Files with one fault each, by a generator whose author had not read the checks, as `labctl inspect` reads them.

Each of the kinds is made `LABCTL_STUDY_FORENSICS` times, ten times as many files are clean. A fault is *named* when a
finding has one of the names that are right for it, *refused* when the file is refused in a sentence that names it or
its rows, *else* when only other findings are there, and *missed* when there are none.
"""

from __future__ import annotations

import gzip
import json
import os
import tempfile
import zlib
from collections import Counter
from collections.abc import Collection
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from labctl.errors import LabctlError
from labctl.services.recordings.examination import inspection_of_file
from studies.blind.clean import CLEAN
from studies.blind.fault_kinds import KINDS
from studies.blind.records import Record

RECORDS = int(os.environ.get("LABCTL_STUDY_FORENSICS", "20"))
SEED = 97
#: What a refusal says that names the rows, or the value, that are wrong.
NAMES_ROWS = ("does not follow", "no finite number", "is not possible", "is not a number")
OUTCOMES = ("named", "refused", "else", "missed")


def written(record: Record, stem: Path) -> Path:
    """Write a record in its form, and return the path of the file or folder."""
    factor = np.pi / 180.0 if record.unit == "rad/s" else 1.0
    outputs = {axis: values * factor for axis, values in record.gyro.items()}
    if record.form == "folder":
        return _folder(record, outputs, stem)
    columns: dict[str, object] = {}
    if record.dataset is not None:
        columns["data set"] = record.dataset.astype(int)
    columns["t (s)"] = np.round(record.t_s, 6)
    if record.position is not None:
        columns["position"] = record.position
    if record.table_rate is not None:
        columns["table rate (deg/s)"] = record.table_rate
    columns |= {f"gyro_{axis} ({record.unit})": values for axis, values in outputs.items()}
    columns["temperature (degC)"] = np.round(record.temperature, 6)
    if record.form == "parquet":
        path = stem.with_suffix(".parquet")
        pq.write_table(pa.table({name: pa.array(values) for name, values in columns.items()}), path)
        return path
    text = _text(columns, ";" if record.form == "semicolon" else ",")
    if record.form == "gz":
        path = stem.with_suffix(".csv.gz")
        path.write_bytes(gzip.compress(text.encode()))
    else:
        path = stem.with_suffix(".csv")
        path.write_text(text)
    return path


def _text(columns: dict[str, object], separator: str) -> str:
    cells = [[_cell(value) for value in values] for values in columns.values()]  # type: ignore[attr-defined]
    return "\n".join([separator.join(columns), *(separator.join(row) for row in zip(*cells, strict=True))]) + "\n"


def _cell(value: object) -> str:
    if not isinstance(value, float):
        return str(value)
    return "" if np.isnan(value) else f"{value:.9g}"


def _folder(record: Record, outputs: dict[str, np.ndarray], stem: Path) -> Path:
    stem.mkdir()
    axes, n = list(outputs), record.size
    head = f'format = "labctl-recording/1"\nserial = "U1"\naxes = {json.dumps(axes)}\nkind = "samples"\n'
    head += 'started_at = "2026-01-05T08:00:00Z"\n' + "".join(f'[output.{a}]\nunit = "{record.unit}"\n' for a in axes)
    (stem / "recording.toml").write_text(head)
    columns: dict[str, object] = {
        "dataset": np.ones(n, int) if record.dataset is None else record.dataset.astype(int),
        "t_s": np.round(record.t_s, 6),
        "position": [axes[-1]] * n if record.position is None else record.position,
        "table_rate_dps": np.zeros(n) if record.table_rate is None else record.table_rate,
        "temperature_c": np.round(record.temperature, 6),
        **{f"gyro_{axis}": values for axis, values in outputs.items()},
    }
    (stem / "samples.csv").write_text(_text(columns, ","))
    return stem


def said_of(kind: str, index: int, seed: int, folder: Path) -> tuple[frozenset[str], str]:
    """Return the names of the findings of a made file, and the refusal, if it was refused."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode()), index])
    record = CLEAN[kind](rng) if kind in CLEAN else KINDS[kind][0](rng)
    path = written(record, folder / f"{kind}-{index}")
    try:
        return frozenset(each.what for each in inspection_of_file(path).warnings), ""
    except LabctlError as error:
        return frozenset(), str(error)


def outcome(kind: str, names: frozenset[str], refusal: str) -> str:
    """Return which of the outcomes a fault of a kind has."""
    right = KINDS[kind][1]
    if refusal:
        return "refused" if any(each in refusal for each in (*NAMES_ROWS, *right)) else "else"
    return "named" if names & right else "else" if names else "missed"


def run(
    records: int = RECORDS, kinds: Collection[str] = tuple(KINDS), seed: int = SEED, clean: int | None = None
) -> str:
    """Return a table: of each kind in how many files it was named, refused, called otherwise or missed."""
    lines = [f"{'kind':20}{'files':>6}" + "".join(f"{each:>9}" for each in OUTCOMES)]
    with tempfile.TemporaryDirectory() as place:
        for kind in kinds:
            found = Counter(outcome(kind, *said_of(kind, k, seed, Path(place))) for k in range(records))
            lines.append(f"{kind:20}{records:6}" + "".join(f"{found[each]:9}" for each in OUTCOMES))
        number = 10 * records if clean is None else clean
        names = list(CLEAN)
        said = [said_of(names[k % len(names)], k, seed, Path(place)) for k in range(number)]
    refused = sum(bool(refusal) for _, refusal in said)
    false = Counter(name for each, _ in said for name in each)
    number_false = sum(bool(each) for each, _ in said)
    lines.append(f"clean {number}: {number_false} with a finding ({dict(false)}), {refused} refused")
    return "\n".join(lines)


if __name__ == "__main__":
    print(run())
