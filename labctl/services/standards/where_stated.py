"""Where reference standards are stated: one answer for every page, command and document, by where the data came from.

What a recording states is never changed. A campaign copies the standards of its bench
file, an import those of its files.
"""

from __future__ import annotations

from collections.abc import Sequence

from instruments.standards import UNITS
from labctl.fitting.uncertainty.standard_lines import EARTH_RATE
from labctl.store import RecordingRow

#: The files of an import; `{map}` is the place of the same in the column map of a log.
IMPORTED_FILES = "recording.toml of the imported folder (or, of a log, {map} of its column map)"


def were_imported(rows: Sequence[RecordingRow]) -> bool:
    """Return whether the newest recording with readings was imported: no campaign of this database measured it."""
    measured = [row for row in rows if row.kind != "coefficients"]
    return not measured or measured[-1].campaign is None


def file_of_standards(*, imported: bool) -> str:
    """Return the file whose `[[standards]]` count."""
    return IMPORTED_FILES.format(map="[[info.standards]]") if imported else "the bench file"


def place_of_standards(*, imported: bool) -> str:
    """Return the place of the standards, with when they count from there."""
    return f"[[standards]] in {file_of_standards(imported=imported)}, before the {'import' if imported else 'campaign'}"


def remedy_of_unstated(names: Sequence[str], *, imported: bool) -> str:
    """Return the sentence that says what brings lines of a budget into U that are not in it.

    `names` are those of the lines. Empty: nothing that is stated does.
    """
    standards = [name for name in names if name in UNITS]
    stated = [f"{', '.join(standards)} as [[standards]]"] if standards else []
    if EARTH_RATE in names:
        stated.append(f"latitude_deg for {EARTH_RATE}")
    if not stated:
        return ""
    again = "import it again" if imported else "measure the unit again"
    file = file_of_standards(imported=imported)
    return f"State {' and '.join(stated)} in {file}; then {again} and fit the new recording."
