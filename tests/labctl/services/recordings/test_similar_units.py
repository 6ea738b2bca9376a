"""A serial number that was mistyped makes a new unit: the import says so, and which unit it may be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from labctl.recording import Recording, read_recording, write_recording
from tests.helpers.lab import Lab
from tests.helpers.paths import EXAMPLES


@pytest.fixture(scope="module")
def recording() -> Recording:
    return read_recording(EXAMPLES / "imucal-turns")


def imported(lab: Lab, recording: Recording, serial: str, folder: Path) -> tuple[bool, str | None]:
    write_recording(replace(recording, info=recording.info.model_copy(update={"serial": serial})), folder, "csv")
    answer = lab.json("import", str(folder))
    return answer["new_unit"], answer["similar_unit"]


def test_a_new_unit_is_said_with_the_one_that_it_may_be(recording: Recording, tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    given = ["FOG-0017", "FOG-0017", "FOG-0071", "F0G-0017", "MEMS-5"]
    said = [imported(lab, recording, serial, tmp_path / str(k)) for k, serial in enumerate(given)]
    assert [new for new, _ in said] == [True, False, True, True, True]
    assert [similar for _, similar in said] == [None, None, "FOG-0017", "FOG-0017", None]
    assert "is new here" not in lab.run("import", str(tmp_path / "2")).stdout
    made = recording.info.model_copy(update={"serial": "FOG-0018"})
    write_recording(replace(recording, info=made), tmp_path / "another", "csv")
    assert (
        "unit FOG-0018 is new here; unit FOG-0017 is there too" in lab.run("import", str(tmp_path / "another")).stdout
    )
