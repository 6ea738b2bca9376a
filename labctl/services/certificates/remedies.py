"""What a person does about a mandatory fact that no order can state: one sentence each.

A stored recording is never changed: what it has to state is written in its files, which are imported again.
"""

from __future__ import annotations

from labctl.fitting.uncertainty.evaluated_lines import NO_POWER_ON
from labctl.services.standards.where_stated import IMPORTED_FILES, file_of_standards

IMPORT_AGAIN = "import it again, fit the new recording and certify that version"
MEASURE_AGAIN = "measure the unit again, and certify the version that is fitted to the new recording"
NO_RECORDING = "Fit a model to a measured recording of the unit on the page Explore, and certify that version."
NO_TEMPERATURE = (
    "Measure the unit again with a thermometer in the chamber or on the unit, or import the log again with its column "
    "of temperature (temperature_c or chamber_c); then fit the new recording and certify that version."
)
LABORATORY = f"Complete [laboratory] in the bench file, which counts in place of one in the order, {MEASURE_AGAIN}."
LATER = "A [laboratory] in the bench file states it in every certificate of later campaigns."
DUE = "Certify the version again with a number of days until it is due."


def of_authorisation(version: int) -> str:
    """Return what puts a version in force."""
    return f'Certify version {version}: on the page of its unit, press the button "Certify: put in force".'


def of_model(imported: bool) -> str:
    """Return where the model of the item is stated."""
    if imported:
        return f"State model in {IMPORTED_FILES.format(map='[info] model')}, {IMPORT_AGAIN}."
    return f"State model of [[gyros]] in the bench file, {MEASURE_AGAIN}."


def of_standards(imported: bool) -> str:
    """Return where reference standards are stated; their uncertainties are part of U, so they cannot come later."""
    return (
        "State [[standards]], each with certificate, issued_by and due, and at least one of the rate, in "
        f"{file_of_standards(imported=imported)}, {IMPORT_AGAIN if imported else MEASURE_AGAIN}."
    )


def of_uncertainty(why: str, imported: bool) -> str:
    """Return what makes a part of U known; `why` says why it is not."""
    if why != NO_POWER_ON:
        return f"Not known: {why}. Measure or fit again as this says, and certify that version."
    if imported:
        return (
            f"Not known: {why}. State bias_repeatability_dps, from the maker's data sheet, in [datasheet] of "
            f"{IMPORTED_FILES.format(map='[info.datasheet]')}, {IMPORT_AGAIN}; or import a "
            "recording of two power-ons or more."
        )
    return (
        f"Not known: {why}. State bias_repeatability_dps, from the maker's data sheet, in datasheet of the gyro in the "
        f"bench file, or choose a recipe with two power-ons or more; then {MEASURE_AGAIN}."
    )
