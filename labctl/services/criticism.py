"""Criticism: a calibration version held against a recording, an effect added to it, and the ladder of versions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from labctl.calibration import build_calibration
from labctl.errors import BadInput
from labctl.fitting import FitResult
from labctl.fitting.context import context_of
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.compress import thin
from labctl.fitting.effects import CATALOGUE, Effect, Formula, Term, formulas, kind_of, parse_term, read_formula
from labctl.fitting.fit import fit_context
from labctl.fitting.model import ErrorModel
from labctl.fitting.presets import changed
from labctl.recording import Recording
from labctl.services.acts import ImproveRequest
from labctl.services.answers import CriticismAnswer, FitAnswer, LadderAnswer, LadderRow
from labctl.services.criticism_text import answer_of
from labctl.services.experiments import experiments_for
from labctl.services.kept import kept
from labctl.services.recordings import newest_recording
from labctl.store import CalibrationRecord, NewCalibration, Store

ERRORS = ("raw_rms_dps", "rms_dps", "heldout_rms_dps", "noise_floor_dps")


def criticise_unit(
    store: Store, serial: str, version: int | None, recording: int | None, competing: Sequence[Formula] = ()
) -> CriticismAnswer:
    """Hold a version (default: the newest) against a recording (default: the newest). Raises NotFound, BadInput."""
    row = _version(store, serial, version)
    number = newest_recording(store, serial, recording)
    catalogue = _catalogue(competing)

    def work() -> CriticismAnswer:
        found = _criticise(store, number, model_of(row), catalogue)
        return answer_of(serial, row.version, number, found, experiments_for(store, number, found))

    question = {
        "serial": serial, "version": row.version, "model": row.answer["model"], "recording": number,
        "readings": store.recordings.fingerprint(number), "formulas": [[each.id, each.text] for each in competing],
    }  # fmt: skip
    return kept(CriticismAnswer, question, work)


def _criticise(store: Store, recording: int, model: ErrorModel, catalogue: Mapping[str, Effect]) -> Criticism:
    return criticise(readings_of(store, recording), model, catalogue, points=store.recordings.points(recording))


def readings_of(store: Store, recording: int) -> Recording:
    """Return a recording's readings at no more than criticism needs, data set by data set; points as they are."""
    head = store.recordings.get(recording)
    points = store.recordings.points(recording)
    if head.kind != "samples":
        return points
    info = points.info.model_copy(update={"kind": "samples"})
    parts = [thin(Recording(info, columns, None)).columns for _, columns in store.recordings.iter_datasets(recording)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return Recording(info, columns, points.environment)


def improve_unit(store: Store, serial: str, request: ImproveRequest, at: datetime) -> FitAnswer:
    """Change a version's effects, fit again, keep it as the next. Raises NotFound, BadInput, NotEnoughData."""
    row = _version(store, serial, request.version)
    model = model_of(row)
    number = newest_recording(store, serial, request.recording)
    points = store.recordings.points(number)
    context = context_of(points)
    for effect_id in request.remove:
        if effect_id not in model.effect_ids:
            raise BadInput(f"effect {effect_id!r} is not in version {row.version} ({', '.join(model.effect_ids)})")
    written = [read_formula(line) for line in request.formula]
    wanted = [*(parse_term(text) for text in request.add), *(Term(f.id, formula=f.text) for f in written)]
    if not wanted and not request.remove:
        raise BadInput("say what to change: --add EFFECT, --remove EFFECT or --formula 'name: expression'")
    base, _ = changed(model, (), tuple(request.remove)).build(context)
    add = tuple(_shaped(store, number, points, base, term) for term in wanted)
    before = fit_context(context, changed(model))
    after = fit_context(context, changed(model, add, tuple(request.remove)))
    return _keep(store, serial, row.version, number, points, before, after, at)


def _shaped(store: Store, recording: int, points: Recording, base: ErrorModel, term: Term) -> Term:
    """Return a term with the order and the nonlinear parameters that fit the recording best."""
    kind = kind_of(term)
    if term.order is not None or not (kind.parameters or kind.max_order):
        return term
    found = criticise(readings_of(store, recording), base, {kind.id: kind}, points=points, shape_only=True)
    shape = found.verdict.terms.get(kind.id)
    return replace(shape, steady=True) if shape is not None else term


def _keep(
    store: Store, serial: str, parent: int, recording: int, points: Recording, before: FitResult, after: FitResult,
    at: datetime,
) -> FitAnswer:  # fmt: skip
    made = {"recording": recording, "improved_from": parent}

    def build(version: int) -> NewCalibration:
        calibration = build_calibration(
            points.info, after, version=version, parent=parent, issued_at=at, provenance=made
        )
        answer = {
            "serial": serial, "version": version, "parent": parent, **after.to_json(), **made,
            "before": before.error.to_dict(), "plausible": plausible(after, points.info.technology or ""),
            "left_out": list(calibration.document["left_out"]), "hash": calibration.hash,
        }  # fmt: skip
        return NewCalibration(
            parent, recording, after.fitted.model.name, calibration.to_bytes(), calibration.hash, answer
        )

    return FitAnswer.model_validate(dict(store.calibrations.add(serial, at, build).answer))


def plausible(result: FitResult, technology: str) -> dict[str, dict[str, Any]]:
    """Return effect -> the range its first coefficient usually lies in, and whether it does on every axis."""
    found: dict[str, dict[str, Any]] = {}
    for term in result.fitted.model.terms:
        span = kind_of(term).ranges.get(technology)
        if span is None:
            continue
        sizes = [
            float(np.max(np.abs(fit.values[fit.effects.index(term.effect)])))
            for fit in result.fitted.axes.values()
            if term.effect in fit.effects
        ]
        limit = max(abs(span[0]), abs(span[1]))
        found[term.effect] = {"from": span[0], "to": span[1], "inside": all(size <= limit for size in sizes)}
    return found


def ladder(store: Store, serial: str) -> LadderAnswer:
    """Return the error of every version, oldest first, down to the noise floor. Raises NotFound."""
    rows = sorted(store.calibrations.of_unit(store.units.get(serial).serial), key=lambda row: row.version)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first")
    steps = [
        LadderRow(
            version=row.version, parent=row.parent, model=row.model, effects=list(row.answer["model"]["effects"]),
            **{key: row.answer["error"][key] for key in ERRORS},
        )
        for row in rows
    ]  # fmt: skip
    floors = [step.noise_floor_dps for step in steps if step.noise_floor_dps is not None]
    return LadderAnswer(serial=serial, steps=steps, noise_floor_dps=min(floors) if floors else None)


def model_of(row: CalibrationRecord) -> ErrorModel:
    """Return the whole model of a version, with what does not leave the house. Raises BadInput for an old row."""
    record = row.answer["model"]
    if "terms" not in record:
        raise BadInput(f"version {row.version} was made by an older labctl; fit it again, then criticise that")
    return ErrorModel.from_dict(record)


def _version(store: Store, serial: str, version: int | None) -> CalibrationRecord:
    rows = store.calibrations.of_unit(store.units.get(serial).serial)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first")
    if version is None:
        return max(rows, key=lambda row: row.version)
    return store.calibrations.get(serial, version)


def _catalogue(written: Sequence[Formula]) -> dict[str, Effect]:
    for each in written:
        if each.id in CATALOGUE:
            raise BadInput(f"formula {each.id!r}: the catalogue has an effect of that name; choose another")
    return {**CATALOGUE, **{each.id: each for each in written}}


def with_files(sources: list[str]) -> list[Formula]:
    """Return formulas from lines `name: expression` and from files of this machine; raises BadInput."""
    return [each for source in sources for each in formulas(source)]


def as_lines(sources: list[str]) -> list[str]:
    """Return formulas as lines `name: expression`, with those of files read here; raises BadInput."""
    return [f"{each.id}: {each.text}" for each in with_files(sources)]


def write_next(answer: CriticismAnswer, path: Path) -> None:
    """Write the best next experiment as a recipe that a campaign can be started from. Raises BadInput without one."""
    if not answer.experiments:
        raise BadInput(f"{path}: there is no experiment to write; the verdict is {answer.verdict!r}")
    path.write_text(answer.experiments[0]["toml"], encoding="utf-8")
