"""A recording whose readings do not scatter goes the whole way, by the command line and over HTTP."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from labctl.recording import Recording, RecordingInfo, write_recording
from tests.helpers.lab import Lab
from tests.helpers.service import open_client

#: Name -> readings of a data set, and the step of the output, deg/s (0: exact).
CASES = {"one": (1, 0.0), "two": (2, 0.0), "exact": (20, 0.0), "coarse": (600, 5.0), "coarse and two": (2, 5.0)}


def without_scatter(per_set: int, step_dps: float) -> Recording:
    """Return readings that are equal within each of 21 data sets."""
    rate = np.repeat(np.tile([0.0, 10.0, -10.0, 50.0, -50.0, 100.0, -100.0], 3), per_set)
    output = 1.01 * rate + 0.02
    columns = {
        "dataset": np.repeat(np.arange(1, 22), per_set),
        "t_s": 0.1 * np.arange(len(rate)),
        "table_rate_dps": rate,
        "temperature_c": np.repeat([-20.0, 10.0, 40.0], 7 * per_set),
        "gyro_z": np.round(output / step_dps) * step_dps if step_dps else output,
    }
    info = RecordingInfo(serial="G", axes=("z",), kind="samples", started_at=datetime(2026, 1, 5, 8, tzinfo=UTC))
    return Recording(info, columns)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_data_without_scatter_pass_through_fit_and_criticism(tmp_path: Path, case: str) -> None:
    write_recording(without_scatter(*CASES[case]), tmp_path / "made")
    lab = Lab(tmp_path)
    lab.run("import", str(tmp_path / "made"))
    lab.run("fit", "G", "--effects", "bias,scale_factor")
    verdict = lab.json("criticise", "G")["verdict"]
    assert verdict in {"adequate", "missing", "ambiguous", "unexplained", "insufficient_data"}
    lab.run("criticise", "G", status=1 if verdict == "insufficient_data" else 0)
    lab.run("ladder", "G")
    lab.run("improve", "G", "--add", "bias_temperature")
    version = "/api/units/G/calibrations/1"
    paths = [f"{version}/{part}" for part in ("", "assessment", "verification", "criticism", "residuals", "pictures")]
    paths += [f"{version}/{part}" for part in ("comparison?recording=1", "surface?axis=z", "uncertainty?rate_dps=1")]
    paths += ["/api/units/G/ladder", "/api/recordings/1", "/api/recordings/1/datasets", "/api/recordings/1/allan"]
    with open_client(lab.database) as client:
        asked = {path: client.get(path.rstrip("/")) for path in paths}
    reported = {200, 400, 422}
    assert {path: each.text[:200] for path, each in asked.items() if each.status_code not in reported} == {}
