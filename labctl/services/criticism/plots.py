"""A criticism's pictures for pages: Plotly figures as JSON, each with how to read it."""

from __future__ import annotations

import hashlib
import json

from labctl.answers.views import PictureResponse, PicturesResponse
from labctl.services.cache import cached
from labctl.services.criticism.comparison import drawn_comparison
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.criticism.ladder import ladder
from labctl.store import Store


def pictures_unit(store: Store, serial: str, version: int | None, recording: int | None) -> list[PictureResponse]:
    """Return the pictures of a version's criticism and of its unit's ladder. Raises NotFound, BadInput."""
    criticism, steps = criticise_unit(store, serial, version, recording), ladder(store, serial)
    compared = drawn_comparison(store, serial, criticism.version, criticism.recording)

    def work() -> PicturesResponse:
        from labctl.plots import pictures_of  # noqa: PLC0415  a service starts without a drawing library

        pictures = [
            PictureResponse(
                id=picture.id, title=picture.title, how_to_read=picture.caption, effects=list(picture.effects),
                figure=json.loads(picture.figure.to_json()),
            )
            for picture in pictures_of(criticism, steps, compared)
        ]  # fmt: skip
        return PicturesResponse(pictures=pictures)

    numbers = "\n".join(answer.model_dump_json() for answer in (criticism, steps, compared) if answer is not None)
    return cached(PicturesResponse, {"numbers": hashlib.sha256(numbers.encode()).hexdigest()}, work).pictures
