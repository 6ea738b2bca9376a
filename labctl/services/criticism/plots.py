"""A criticism's pictures for pages: Plotly figures as JSON, each with how to read it."""

from __future__ import annotations

import hashlib
import json
from typing import cast

from labctl.json_types.answers import CriticismJson, LadderJson
from labctl.services.cache import cached
from labctl.services.criticism.comparison import comparison_json
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.criticism.ladder import ladder
from labctl.services.schemas.criticism import CriticismResponse, PictureResponse, PicturesResponse
from labctl.services.schemas.reports.ladder import LadderResponse
from labctl.store import Store


def criticism_json(answer: CriticismResponse) -> CriticismJson:
    """Return a criticism as plots read it."""
    return cast(CriticismJson, answer.model_dump(mode="json"))


def ladder_json(answer: LadderResponse) -> LadderJson:
    """Return a ladder as plots read it."""
    return cast(LadderJson, answer.model_dump(mode="json"))


def pictures_unit(store: Store, serial: str, version: int | None, recording: int | None) -> list[PictureResponse]:
    """Return the pictures of a version's criticism and of its unit's ladder. Raises NotFound, BadInput."""
    verdict, steps = criticise_unit(store, serial, version, recording), ladder(store, serial)
    compared = comparison_json(store, serial, verdict.version, verdict.recording)

    def work() -> PicturesResponse:
        from labctl.plots import pictures_of  # noqa: PLC0415  a service starts without a drawing library

        responses = [
            PictureResponse(
                id=picture.id, title=picture.title, how_to_read=picture.caption, effects=list(picture.effects),
                figure=json.loads(picture.figure.to_json()),
            )
            for picture in pictures_of(criticism_json(verdict), ladder_json(steps), compared)
        ]  # fmt: skip
        return PicturesResponse(pictures=responses)

    numbers = "\n".join([*(answer.model_dump_json() for answer in (verdict, steps)), json.dumps(compared)])
    return cached(PicturesResponse, {"numbers": hashlib.sha256(numbers.encode()).hexdigest()}, work).pictures
