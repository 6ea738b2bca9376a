"""Long lists in parts over HTTP: what a client asks for, and the headers that say how many rows there are."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Request, Response

from labctl.store.paging import KeyT, Page, RowT

#: Of all that match, whatever part of them is sent.
TOTAL = "X-Total-Count"
MAX_ROWS = 10_000

Search = Annotated[
    str, Query(max_length=200, description="Only rows that hold this text, in any case; empty: all rows.")
]
Limit = Annotated[
    int | None,
    Query(ge=1, le=MAX_ROWS, description="Largest number of rows; default: all. The header Link names the next part."),
]
AfterNumber = Annotated[
    int | None, Query(ge=0, description="Number of the last row of the part before; default: from the newest row.")
]
AfterSerial = Annotated[
    str | None, Query(max_length=200, description="Serial number of the last row of the part before.")
]


def in_parts(request: Request, response: Response, page: Page[RowT, KeyT]) -> list[RowT]:
    """Return the rows of a page, and set `X-Total-Count` and, where there are more, `Link` (RFC 8288, rel="next")."""
    response.headers[TOTAL] = str(page.total)
    if page.next_after is not None:
        following = request.url.include_query_params(after=page.next_after)
        response.headers["Link"] = f'<{following.path}?{following.query}>; rel="next"'
    return page.rows
