"""Assessment of a version before it is certified: the verdict on it, and the objections to certifying it."""

from __future__ import annotations

from collections.abc import Iterator

from labctl.answers.certification import (
    AssessmentResponse,
    CertifiedErrors,
)
from labctl.answers.criticism import CriticismResponse
from labctl.answers.judgement import Objection
from labctl.calibration import read_calibration
from labctl.errors import BadInput, NotEnoughData, NotFound
from labctl.fitting.models.inversion import NotConverged
from labctl.services.calibrations.comparison import worse_than_raw, worse_than_version
from labctl.services.calibrations.due import interval_days
from labctl.services.calibrations.uncertainty import over_any_axis
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.standards.usage import Notices
from labctl.store import CalibrationRecord, Store

#: The least length of a reason for an override: a sentence.
MIN_REASON_CHARACTERS, MIN_REASON_WORDS = 20, 3


def assess(store: Store, serial: str, version: int) -> AssessmentResponse:
    """Return what is known of a version; makes the criticism on its own recording where there is none yet.

    Raises NotFound.
    """
    row = store.calibrations.get(store.units.get(serial).serial, version)
    criticism, reason, unusable = _criticised(store, row)
    objections = [*unusable, *_of_verdict(criticism, _errors(row)), *_of_errors(store, row), *_of_data(store, row)]
    objections += _of_standards(store, row)
    due_days, due_from = interval_days(store, serial, version, None)
    history = store.calibrations.history(row.serial)
    return AssessmentResponse(
        serial=serial,
        version=version,
        verdict=criticism.verdict if criticism else None,
        verdict_reason=reason,
        verdict_recording=criticism.recording if criticism else None,
        verdict_text=_sentence(criticism) if criticism else "",
        cause_not_known=criticism.cause_not_known if criticism else [],
        error=_errors(row),
        any_axis=over_any_axis(read_calibration(row.document)),
        objections=objections,
        override_needed=bool(objections),
        least_reason_characters=MIN_REASON_CHARACTERS,
        least_reason_words=MIN_REASON_WORDS,
        due_days=due_days,
        due_from=due_from,
        in_force=any((each.act, each.version) == ("certify", version) for each in history[:1]),
    )


def _of_standards(store: Store, row: CalibrationRecord) -> Iterator[Objection]:
    """Yield an objection for each standard that was found bad on the days of the version's measurements."""
    for text in Notices.of(store).of_recordings(row.recordings):
        yield Objection(what="standard", text=text, do="measure again with another standard")


def _criticised(store: Store, row: CalibrationRecord) -> tuple[CriticismResponse | None, str, list[Objection]]:
    """Return the criticism of a version on its own recording, or None and why there cannot be one.

    A model that has no inverse on its own recording is an objection.
    """
    if row.recording is None:
        return None, "the version was made without a recording", []
    if store.recordings.get(row.recording).kind == "coefficients":
        return None, f"recording {row.recording} is a table of coefficients and has no measurements to compare with", []
    try:
        return criticise_unit(store, row.serial, row.version, None, recordings=row.recordings), "", []
    except (BadInput, NotEnoughData, NotFound) as error:
        return None, str(error), []
    except NotConverged as error:
        return None, str(error), [Objection(what="verdict", text=f"no verdict: {error}", do="fit another model")]


def _sentence(criticism: CriticismResponse) -> str:
    """Return the verdict in words, without the warnings that stand before it."""
    return criticism.text[len(criticism.warnings)]


def _of_verdict(criticism: CriticismResponse | None, error: CertifiedErrors) -> Iterator[Objection]:
    """Yield the objection of a verdict by which the model lacks something; its figures are those of the version."""
    if criticism is None or not _lacks_something(criticism):
        return
    figures = ", ".join(
        f"{name} {figure:.4g} deg/s"
        for name, figure in (
            ("RMS error", error.rms_dps),
            ("on data left out of the fit", error.heldout_rms_dps),
            ("noise floor", error.noise_floor_dps),
        )
        if figure is not None
    )
    version = f"{criticism.serial} --version {criticism.version}"
    do = f"find out which effect is missing, on the page of the version or by labctl criticise {version}"
    if criticism.verdict == "missing":
        do = (
            f"add {criticism.named[0]} and certify the new version, on the page of the version or by "
            f"labctl improve {version} --add {criticism.named[0]}"
        )
    elif criticism.verdict == "ambiguous":
        do = (
            "make the measurement that distinguishes these effects (on the page of the version, or by labctl criticise "
            f"{version}), add the right one and certify the new version"
        )
    text = (
        f"the verdict on recording {criticism.recording} is {criticism.verdict!r} ({figures}): {_sentence(criticism)}"
    )
    yield Objection(what="verdict", text=text.rstrip("."), do=do)


def _lacks_something(criticism: CriticismResponse) -> bool:
    """Return whether the model leaves more than noise.

    Of an ambiguous verdict: whether its leader takes off a share of the excess over noise, 0 where there is no excess.
    """
    if criticism.verdict == "ambiguous":
        leader = [suspect for suspect in criticism.suspects if suspect["effect"] in criticism.named[:1]]
        return all(each["share_removed"] > 0 for each in leader)
    return criticism.verdict in {"missing", "unexplained"}


def _of_errors(store: Store, row: CalibrationRecord) -> Iterator[Objection]:
    """Yield an objection for every error before it that is smaller: raw, its parent's, that of the one in force."""
    errors = _errors(row)
    for finding in worse_than_raw(errors):
        yield Objection(what="worse", text=finding.said, do=finding.do)
    history = store.calibrations.history(row.serial)
    in_force = history[0].version if history and history[0].act == "certify" else None
    others = {row.parent: "from which it was made"} | {in_force: "which is in force"}
    for version, role in others.items():
        if version is None or version == row.version:
            continue
        other = store.calibrations.get(row.serial, version)
        if other.recordings != row.recordings:
            continue
        worse = worse_than_version(_errors(other), errors)
        if worse:
            text = f"{worse} of version {version}, {role}, on the same recording"
            yield Objection(what="worse", text=text, do=f"certify version {version}, or improve this version")


def _errors(row: CalibrationRecord) -> CertifiedErrors:
    error = row.answer["error"]
    return CertifiedErrors(**{key: error.get(key) for key in CertifiedErrors.model_fields})


def _of_data(store: Store, row: CalibrationRecord) -> Iterator[Objection]:
    """Yield what is certainly wrong with the recordings of a version: what was fitted, and what was to verify it."""
    if row.recording is None:
        return
    for number, warning in (
        (n, w) for n in row.recordings for w in inspect_stored(store, store.recordings.get(n)).warnings
    ):
        if warning.severity == "certain":
            text = f"recording {number}: {warning.where}: {warning.said} (expected {warning.expected})"
            again = "fit again" if warning.part == "fitted" else "measure the verification part again"
            yield Objection(what="data", text=text, do=f"{warning.do}, and {again}")
