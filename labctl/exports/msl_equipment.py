"""A calibration as an entry of an equipment register that MSL's msl-equipment reads: XML, a table for each axis.

Structure and names of the elements: https://mslnz.github.io/msl-equipment, schema of 2026. The schema also lists MSL's
own staff, teams, locations and quantities; the register that is read takes any.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date
from xml.etree import ElementTree as ET

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.comments import head_lines
from labctl.exports.format import Format, Loss, Written
from labctl.exports.lookup_table import Table, largest_difference, table_of
from labctl.exports.options import whole_number
from labctl.exports.static_part import needs_thermometer, static_part

NAME = "msl-equipment"
SPACE = "https://measurement.govt.nz/equipment-register"
QUANTITY = "Angular Rate"
#: Points of the table, as of the CSV: fewer, since every one is a line of XML.
OUTPUTS, TEMPERATURES, MOST = 21, 11, 201
#: Options that are facts which a calibration does not know.
NEEDED = {
    "id": "number of the gyro in the register",
    "team": "team that keeps the register",
    "entered_by": "person who enters the gyro in the register",
    "manufacturer": "maker of the gyro",
    "laboratory": "laboratory that calibrated it",
    "report": "number of the certificate",
    "started": "first day of the calibration, such as 2027-03-01",
    "stopped": "last day of the calibration",
}
OTHER = {
    "location": "where the gyro is kept; default: empty",
    "procedure": "number of the laboratory's procedure; default: empty",
    "interval_years": "calibration interval, years; default 1",
}
HEADER = ("By axis", "Output", "Temperature", "Error")
TYPES = ("string", "double", "double", "double")
UNITS = ("axis", "deg/s", "deg C", "deg/s")


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the entry; raises BadInput for a fact that is not given, and for a model that no table can hold."""
    if lacking := [name for name in NEEDED if not options.get(name, "").strip()]:
        raise BadInput(
            f"format {NAME}: the entry in the register needs {', '.join(lacking)}; give --option KEY=VALUE for each"
        )
    needs_thermometer(
        calibration,
        NAME,
        "the error of this calibration is the same at every temperature; use format python, c or json",
    )
    part = static_part(calibration, NAME, carries="the table of this format depends on output and temperature only")
    m = whole_number(options, "outputs", (2, MOST), OUTPUTS, NAME) if part.has_rates else 1
    n = whole_number(options, "temperatures", (2, MOST), TEMPERATURES, NAME)
    table = table_of(part, part.outputs(m), part.temperatures(n))
    differs = largest_difference(part, table)
    losses = (Loss("the uncertainty of the correction"), *part.losses())
    head = head_lines(calibration, "the whole correction of output and temperature", differs, losses, [
        "Rate of a component = its Output - the sum over By axis of Error, linear between Output of By axis and",
        "between Temperature; outside the table hold both at its edge.",
    ])  # fmt: skip
    root = _register(calibration, options, table)
    root.insert(0, ET.Comment("\n" + "\n".join(head).replace("--", "- -") + "\n"))
    ET.indent(root, "  ")
    content = ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"
    return Written(content, losses, differs)


def _register(calibration: Calibration, options: Mapping[str, str], table: Table) -> ET.Element:
    root = ET.Element("register", {"team": options["team"], "xmlns": SPACE})
    entry = ET.SubElement(root, "equipment", {"enteredBy": options["entered_by"]})
    for name, text in (
        ("id", options["id"]),
        ("manufacturer", options["manufacturer"]),
        ("model", calibration.document["unit"]["model"] or "unknown"),
        ("serial", calibration.serial),
        ("description", f"Gyroscope, axes {', '.join(calibration.axes)}"),
        ("specifications", ""),
        ("location", options.get("location", "")),
        ("status", "Active"),
        ("loggable", "true"),
        ("traceable", "true"),
    ):
        ET.SubElement(entry, name).text = text or None
    measurand = ET.SubElement(
        ET.SubElement(entry, "calibrations"),
        "measurand",
        {"quantity": QUANTITY, "calibrationInterval": options.get("interval_years", "1")},
    )
    for index, axis in enumerate(calibration.axes):
        component = ET.SubElement(measurand, "component", {"name": f"Axis {axis}"})
        _report(component, calibration, options, table, index)
    for name in ("maintenance", "alterations", "firmware", "specifiedRequirements", "referenceMaterials",
                 "qualityManual"):  # fmt: skip
        ET.SubElement(entry, name)
    return root


def _report(
    component: ET.Element, calibration: Calibration, options: Mapping[str, str], table: Table, index: int
) -> None:
    """Add the report of one axis: dates, laboratory, conditions, and its table."""
    entered = {"id": f"{options['report']} {calibration.axes[index]}", "enteredBy": options["entered_by"]}
    report = ET.SubElement(component, "report", entered)
    for name, text in (
        ("reportIssueDate", calibration.document["issued_at"][:10]),
        ("measurementStartDate", _day(options, "started")),
        ("measurementStopDate", _day(options, "stopped")),
        ("issuingLaboratory", options["laboratory"]),
        ("technicalProcedure", options.get("procedure", "")),
    ):
        ET.SubElement(report, name).text = text or None
    low, high = calibration.temperature_c
    conditions = ET.SubElement(report, "conditions")
    ET.SubElement(conditions, "temperature", {"unit": "deg C"}).text = f"{low:g} to {high:g}"
    ET.SubElement(report, "acceptanceCriteria")
    listed = ET.SubElement(report, "table", {"comment": f"labctl calibration {calibration.calibration_hash}"})
    for name, words in (("type", TYPES), ("unit", UNITS), ("header", HEADER)):
        ET.SubElement(listed, name).text = ",".join(words)
    ET.SubElement(listed, "data").text = "\n".join(_rows(calibration.axes, table, index))


def _rows(axes: tuple[str, ...], table: Table, index: int) -> list[str]:
    return [
        f"{axes[by]},{output:.12g},{temperature_c:.12g},{table.errors[index, by, i, j]:.9g}"
        for by in range(len(axes))
        for i, output in enumerate(table.outputs)
        for j, temperature_c in enumerate(table.temperatures_c)
    ]


def _day(options: Mapping[str, str], name: str) -> str:
    try:
        return date.fromisoformat(options[name].strip()).isoformat()
    except ValueError:
        raise BadInput(
            f"format {NAME}: option {name} = {options[name]!r} is not a date; write it as 2027-03-01"
        ) from None


FORMAT = Format(
    "Equipment register (MSL)",
    "application/xml",
    "xml",
    write,
    {
        **NEEDED,
        **OTHER,
        "outputs": f"number of outputs, 2 to {MOST}; default {OUTPUTS}",
        "temperatures": f"number of temperatures, 2 to {MOST}; default {TEMPERATURES}",
    },
)
