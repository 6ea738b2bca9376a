"""The entry of an equipment register, read as msl-equipment reads it, against the compensator.

Structure and formulas are those of its documentation, written out here; the package itself is not among the tests'.
"""

from __future__ import annotations

from io import StringIO
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.exports.msl_equipment import FORMAT, NEEDED, write
from tests.helpers.exported import stated, whole_range

SPACE = "{https://measurement.govt.nz/equipment-register}"
OPTIONS = {
    "id": "MSLE.M.001", "team": "Mass", "entered_by": "A. Person", "manufacturer": "Maker", "laboratory": "Lab",
    "report": "ICL-2027-0001", "started": "2027-02-25", "stopped": "2027-02-27",
}  # fmt: skip
#: Children of an entry and of a report, in the order of the schema; the consumer reads them by place.
ENTRY = (
    "id manufacturer model serial description specifications location status loggable traceable calibrations "
    "maintenance alterations firmware specifiedRequirements referenceMaterials qualityManual"
)
REPORT = (
    "reportIssueDate measurementStartDate measurementStopDate issuingLaboratory technicalProcedure conditions "
    "acceptanceCriteria table"
)


def names(element: ET.Element) -> list[str]:
    return [child.tag.removeprefix(SPACE) for child in element]


def table_of(element: ET.Element) -> np.ndarray:
    """Return the table as msl-equipment does: a structured array whose fields are the header."""
    kinds, _, header, data = ([part.strip() for part in (each.text or "").split(",")] for each in list(element))
    del data
    types = {"double": np.float64, "string": "U8"}
    fields = [(name, types[kind]) for name, kind in zip(header, kinds, strict=True)]
    text = (element[3].text or "").strip()
    return np.loadtxt(StringIO(text), dtype=np.dtype(fields), delimiter=",", converters={0: str.strip})


def corrected(root: ET.Element, axes: tuple[str, ...], raw: np.ndarray, warm: np.ndarray) -> np.ndarray:
    rate = raw.copy()
    components = list(root.iter(f"{SPACE}component"))
    assert [each.get("name") for each in components] == [f"Axis {axis}" for axis in axes]
    for column, component in enumerate(components):
        rows = table_of(component[0][-1])
        for index, by in enumerate(axes):
            own = rows[rows["By axis"] == by]
            grid = [np.unique(own[name]) for name in ("Output", "Temperature")]
            values = own["Error"].reshape(len(grid[0]), len(grid[1]))
            at = [np.clip(x, g[0], g[-1]) for x, g in zip((raw[:, index], warm), grid, strict=True)]
            rate[:, column] -= RegularGridInterpolator(grid, values)(np.column_stack(at))
    return rate


@pytest.mark.slow
def test_its_tables_correct_within_the_stated_error(any_calibration: Calibration) -> None:
    text = write(any_calibration, {**OPTIONS, "outputs": "15", "temperatures": "9"}).content.decode()
    raw, warm = whole_range(any_calibration, temperatures=37)
    found = corrected(ET.fromstring(text), any_calibration.axes, raw, warm)
    apart = np.abs(found - Compensator(any_calibration).compensate(raw, warm).rate_dps).max()
    bound = stated(text, "Rates corrected by this file differ from those of the calibration")
    assert 0.2 * bound < apart <= bound


def test_the_entry_has_the_elements_of_the_schema_in_order(fog: Calibration) -> None:
    root = ET.fromstring(write(fog, OPTIONS).content)
    (entry,) = root
    assert root.get("team") == "Mass"
    assert names(entry) == ENTRY.split()
    assert entry.findtext(f"{SPACE}serial") == fog.serial
    (report,) = root.iter(f"{SPACE}report")
    assert names(report) == REPORT.split()
    assert report.get("id") == "ICL-2027-0001 z"
    assert report.findtext(f"{SPACE}measurementStartDate") == "2027-02-25"
    assert write(fog, OPTIONS) == write(fog, OPTIONS)


def test_facts_that_a_calibration_does_not_know_are_asked_for(fog: Calibration) -> None:
    with pytest.raises(BadInput, match=", ".join(NEEDED)):
        write(fog, {})
    with pytest.raises(BadInput, match="option started = 'yesterday' is not a date"):
        write(fog, {**OPTIONS, "started": "yesterday"})
    assert set(NEEDED) <= set(FORMAT.options)
