"""Criticism: a calibration version compared with a recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from labctl.answers.base import ResponseModel
from labctl.answers.criticism import CriticismResponse, Undistinguished
from labctl.answers.residuals import ResidualsResponse
from labctl.errors import BadInput, LabctlError
from labctl.services.cache import cached_group
from labctl.services.criticism.decimated_readings import reading_beside
from labctl.services.criticism.versions import content_digest, version_of
from labctl.services.recordings.loading import chosen_rows, passed_over, readings_question
from labctl.store import CalibrationRecord, RecordingRow, Store

if TYPE_CHECKING:
    from labctl.fitting.criticism import Criticism
    from labctl.fitting.effects import Formula

A = TypeVar("A", bound=ResponseModel)

#: Versions before one that are asked what its effects could not be distinguished from.
LOOKED_BACK = 5


def criticise_unit(
    store: Store,
    serial: str,
    version: int | None,
    recording: int | None,
    competing: Sequence[Formula] = (),
    *,
    recordings: Sequence[int] = (),
    other_unit: bool = False,
) -> CriticismResponse:
    """Compare a version (default: the newest) with a recording (default: the unit's newest), or several as one.

    `other_unit` allows a recording of another unit. Raises NotFound, BadInput.
    """
    row = version_of(store, serial, version)
    measured = chosen_rows(store, serial, recording, recordings, other_unit=other_unit)
    answer = _cached_criticism(CriticismResponse, store, row, measured, competing)
    if answer.verdict == "adequate":
        answer = _with_causes_not_known(answer, store, row, measured)
    if not (newer := passed_over(store, measured, recording, recordings)):
        return answer
    from labctl.services.criticism.answer import with_warnings  # noqa: PLC0415  slow to import

    return with_warnings(answer, newer)


def criticise_seen(
    store: Store, row: CalibrationRecord, measured: tuple[RecordingRow, ...], seen: Callable[[Criticism], None]
) -> CriticismResponse:
    """Compare a version with recordings, whatever is cached; `seen` is given the criticism itself. Raises BadInput.

    The answer proposes nothing to measure next: a fleet job keeps the verdict.
    """
    with reading_beside(store, measured) as decimated:
        from labctl.services.criticism.evaluation import evaluate  # noqa: PLC0415  slow to import

        return evaluate(store, row, measured, (), decimated, seen, plans_next=False)[0]


def _with_causes_not_known(
    answer: CriticismResponse, store: Store, row: CalibrationRecord, measured: tuple[RecordingRow, ...]
) -> CriticismResponse:
    """Return an answer that says, behind the verdict, of which parts of its model the cause is not known."""
    undistinguished = list(_undistinguished(store, row, measured))
    sentences = [
        f"These data do not show that the cause is {each['effect']}, which version {row.version} contains: "
        f"{' or '.join(each['others'])} would explain them as well (criticism of version {each['version']})."
        for each in undistinguished
    ] + [
        f"The formula {term['effect']} of version {row.version} describes the error; it names no cause."
        for term in row.answer["model"].get("terms", ())
        if term.get("formula")
    ]
    place = len(answer.warnings) + 1
    return answer.model_copy(
        update={
            "undistinguished": undistinguished, "cause_not_known": sentences,
            "text": [*answer.text[:place], *sentences, *answer.text[place:]],
        }
    )  # fmt: skip


def _undistinguished(
    store: Store, row: CalibrationRecord, measured: tuple[RecordingRow, ...]
) -> Iterator[Undistinguished]:
    """Yield which effects of a version these data could not tell from others.

    Beside an effect that was added, what explains the same looks like noise: only the version before shows it.
    """
    effects = set(row.answer["model"]["effects"])
    for before, added in _additions(store, row):
        try:
            earlier = _cached_criticism(CriticismResponse, store, before, measured, ())
        except LabctlError:
            continue  # the version before cannot be compared with these data
        groups = {suspect["effect"]: suspect["alias_group"] for suspect in earlier.suspects}
        for effect in added if earlier.verdict == "ambiguous" else ():
            others = [each for each in groups.get(effect, ()) if each in earlier.named and each not in effects]
            if effect in earlier.named and others:
                yield {"effect": effect, "others": others, "version": before.version}


def _additions(store: Store, row: CalibrationRecord) -> Iterator[tuple[CalibrationRecord, list[str]]]:
    """Yield the versions that a version was made from, the newest first, and which of its effects each lacked first.

    Of a long line only the newest are yielded: to criticise each takes seconds.
    """
    missing = set(row.answer["model"]["effects"])
    child = row
    for _ in range(LOOKED_BACK):
        if child.parent is None:
            return
        try:
            before = version_of(store, row.serial, child.parent)
        except LabctlError:
            return
        had = set(before.answer["model"]["effects"])
        added = [each for each in child.answer["model"]["effects"] if each in missing - had]
        missing &= had
        if added:
            yield before, added
        child = before


def residuals_unit(
    store: Store, serial: str, version: int | None, recording: int | None, recordings: Sequence[int] = ()
) -> ResidualsResponse:
    """Return what the same criticism leaves, data set by data set. Raises NotFound, BadInput."""
    row = version_of(store, serial, version)
    return _cached_criticism(ResidualsResponse, store, row, chosen_rows(store, serial, recording, recordings), ())


def _cached_criticism(
    kind: type[A],
    store: Store,
    row: CalibrationRecord,
    measured: tuple[RecordingRow, ...],
    competing: Sequence[Formula],
) -> A:
    """Return one of the answers of a criticism; the first request computes and caches all of them."""

    def work() -> Sequence[ResponseModel]:
        with reading_beside(store, measured) as decimated:
            from labctl.services.criticism.evaluation import evaluate  # noqa: PLC0415  slow to import

            return evaluate(store, row, measured, competing, decimated)

    question = {
        "serial": row.serial, "version": row.version, "calibration": content_digest(row), "model": row.answer["model"],
        **readings_question(store, measured),
        "formulas": [[each.id, each.text] for each in competing],
    }  # fmt: skip
    return cached_group(kind, question, work)


def write_next(answer: CriticismResponse, path: Path) -> None:
    """Write the best next experiment as a recipe that a campaign can be started from. Raises BadInput without one.

    Where laws are proposed it is the one that tests them.
    """
    tests_laws = answer.law_test["toml"] if answer.law_test else ""
    if not answer.experiments and not tests_laws:
        raise BadInput(
            f"{path}: the verdict is {answer.verdict!r}, so no further experiment is needed and no recipe was "
            "written; leave --next out"
        )
    path.write_text(answer.experiments[0]["toml"] if answer.experiments else tests_laws, encoding="utf-8")
