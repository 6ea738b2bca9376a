"""Parameters of PX4 and ArduPilot, exported and imported again: the same bias over temperature."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadRecording
from labctl.fitting import fit
from labctl.fitting.models.temperature import LagrangeTable
from labctl.recording.files import read_recording, write_recording
from labctl.recording.parameter_files import IMPORTER, ParameterOptions, probe, read
from tests.helpers.exported import exported

OPTIONS = ParameterOptions.model_validate(
    {"serial": "MEMS-1", "started_at": "2027-03-01T12:00:00Z", "max_rate_dps": 400}
)
FILES = [("px4", {}, ".params"), ("ardupilot", {"imu": "1"}, ".param"), ("ardupilot", {"imu": "5"}, ".param")]


@pytest.mark.parametrize(("name", "options", "suffix"), FILES)
def test_the_bias_comes_back(
    mems: Calibration, tmp_path: Path, name: str, options: dict[str, str], suffix: str
) -> None:
    text, written = exported(mems, name, **options)
    path = tmp_path / f"gyro{suffix}"
    path.write_text(text, encoding="ascii")
    assert probe(path) == 0.95
    write_recording(read(path, OPTIONS), tmp_path / "recording")  # by the rules of the interchange format
    result = fit(read_recording(tmp_path / "recording"), "yang2018", [])
    table = result.fitted.model.temperature
    assert isinstance(table, LagrangeTable)
    warm = np.array(table.nodes_c)
    still = np.zeros((len(warm), 3))
    for _ in range(20):  # the output at rest
        still = still - Compensator(mems).compensate(still, warm).rate_dps
    for column, axis in enumerate(mems.axes):
        fitted = result.fitted.axes[axis]
        found = fitted.values[fitted.names.index("bias")]
        assert np.abs(found - still[:, column]).max() <= (written.differs_dps or 0.0) + 1e-6


def test_a_file_that_ends_within_a_number_is_refused(mems: Calibration, tmp_path: Path) -> None:
    """A number without its last digits is a number too: only the missing line break shows it."""
    text, _ = exported(mems, "ardupilot", imu="1")
    lines = text.splitlines(keepends=True)
    number = next(k for k, line in enumerate(lines) if "_GYR1_X" in line)
    path = tmp_path / "gyro.param"
    kept = [line for k, line in enumerate(lines) if k != number]
    path.write_text("".join([*kept, lines[number].rstrip()[:-2]]), encoding="ascii")
    with pytest.raises(BadRecording, match=r"the last line has no line break .* export the parameters again"):
        read(path, OPTIONS)


def test_what_a_file_lacks_is_named(mems: Calibration, tmp_path: Path) -> None:
    text, _ = exported(mems, "px4")
    path = tmp_path / "gyro.params"
    path.write_text("\n".join(line for line in text.splitlines() if "TC_G0_X1_2" not in line), encoding="ascii")
    with pytest.raises(BadRecording, match="parameter TC_G0_X1_2 is missing"):
        read(path, OPTIONS)
    path.write_text(text.replace("TC_G0_TMAX", "TC_G0_TMAXX"), encoding="ascii")
    with pytest.raises(BadRecording, match="TC_G0_TMAX is missing"):
        read(path, OPTIONS)
    path.write_text("1\t1\tCAL_ACC0_ID\t1\t6\n", encoding="ascii")
    assert probe(path) == 0.0
    assert "PX4" in IMPORTER.title
