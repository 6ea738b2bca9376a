"""One noise floor: the same figure in the fit, the file, the criticism, the preview, the ladder and the rows."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from labctl.recording import write_recording
from tests.helpers.lab import Lab
from tests.helpers.simulated_recordings import single_axis

FOG = "FOG-0001"


@pytest.mark.slow
def test_every_place_shows_the_same_floor(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    write_recording(single_axis(1, scale_factor_odd=1e-6), tmp_path / "day", "parquet")
    lab.json("import", str(tmp_path / "day"))
    fitted = lab.json("fit", FOG, "--model", "bias_scale")
    floor = fitted["error"]["noise_floor_dps"]
    assert fitted["error"]["rms_dps"] > 5 * floor
    drift, white = fitted["noise"]["z"]["drift_dps"], fitted["noise"]["z"]["white_dps"]
    assert np.hypot(drift, white) == pytest.approx(floor, rel=1e-9)
    document = json.loads(lab.run("calibration", FOG, "--version", "1").stdout)
    improved = lab.json("improve", FOG, "--add", "scale_factor_odd")
    said = [lab.json("criticise", FOG, "--version", version) for version in ("1", "2")]
    ladder = lab.json("ladder", FOG)
    everywhere = {
        "document": document["error"]["noise_floor_dps"],
        "improved": improved["error"]["noise_floor_dps"],
        "before": improved["before"]["noise_floor_dps"],
        "ladder": ladder["noise_floor_dps"],
        **{f"criticism of {each['version']}": each["error"]["noise_floor_dps"] for each in said},
        **{f"step {step['version']}": step["noise_floor_dps"] for step in ladder["steps"]},
    }
    assert everywhere == pytest.approx(dict.fromkeys(everywhere, floor), rel=1e-12)
    assert {each["error"]["noise_floor_source"] for each in said} == {fitted["error"]["noise_floor_source"]}
    assert [each["noise"]["drift_dps"] for each in said] == pytest.approx([drift, drift], rel=1e-12)
    cells = [cell for part in said[1]["maps"] for cell in part["over_floor"]]
    assert np.sqrt(np.mean(np.square(cells))) == pytest.approx(improved["error"]["rms_dps"] / floor, rel=1e-3)
