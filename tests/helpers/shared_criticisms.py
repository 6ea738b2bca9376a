"""Criticisms of equal recordings and models, worked out once: databases of several versions hold the same readings."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from labctl.fitting.criticism import Criticism
from labctl.fitting.models.error_model import ErrorModel
from labctl.recording import Recording
from labctl.services.criticism import evaluation
from labctl.services.criticism import laws as laws_answered


def digest_of(recording: Recording, model: ErrorModel) -> str:
    """Return a digest of every reading, of what is written beside them, and of a model."""
    digest = hashlib.sha256(recording.info.model_dump_json().encode())
    digest.update(json.dumps(model.to_dict(), sort_keys=True).encode())
    for columns in (recording.columns, recording.environment or {}):
        for name, values in columns.items():
            digest.update(f"{name} {values.dtype} {values.shape}".encode())
            digest.update(repr(values.tolist()).encode() if values.dtype.hasobject else values.tobytes())
    return digest.hexdigest()


@contextmanager
def criticised_once() -> Iterator[None]:
    """Criticise in this process each pair of recording and model once while the block runs.

    What is read, what the answer says and what it is compared with stay those of each database.
    """
    made: dict[tuple[str, ...], Any] = {}

    def once(name: str, work: Callable[..., Any]) -> Callable[..., Any]:
        def kept(recording: Recording, model: ErrorModel, *given: Any, **more: Any) -> Any:
            question = (name, digest_of(recording, model), str(more.get("is_decimated")))
            if question not in made:
                made[question] = work(recording, model, *given, **more)
            return made[question]

        return kept

    def laws(found: Criticism) -> Any:
        question = ("laws", str(id(found)))  # `made` keeps it, so that no other object has this number
        if question not in made:
            made[question] = find_laws(found)
        return made[question]

    find_laws = laws_answered.laws_of
    with (
        patch.object(evaluation, "fit_means", once("fit", evaluation.fit_means)),
        patch.object(evaluation, "criticise", once("criticism", evaluation.criticise)),
        patch.object(laws_answered, "laws_of", laws),
    ):
        yield
