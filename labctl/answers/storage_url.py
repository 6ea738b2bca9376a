"""URLs of storages: which are refused, and why."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

MAX_URL_CHARACTERS = 1000
EXAMPLES = "s3://bucket/lab or file:///data/lab"
#: How a URL of a storage is written: scheme, place and folder, and nothing else.
URL = r"^[a-z][a-z0-9+.-]*://[^?#]+$"
#: Type of the error about a URL: what was given is not shown, since it may hold a password.
REFUSED = "storage_url"
#: Schemes in which `container@account` names a place.
_WITH_ACCOUNT = frozenset({"abfs", "abfss", "az"})
#: Schemes whose files only the process that wrote them can read.
_OF_ONE_PROCESS = frozenset({"data", "memory"})


def refused_because(url: str) -> str:
    """Return why a URL of a storage is refused, without repeating it; empty: it is not."""
    if len(url) > MAX_URL_CHARACTERS:
        return f"it has {len(url)} characters, at most {MAX_URL_CHARACTERS} are allowed"
    scheme, _, place = url.partition("://")
    authority = place.partition("/")[0]
    has_user = "@" in authority and (scheme not in _WITH_ACCOUNT or ":" in authority)
    if has_user or "?" in place or "#" in place:
        return (
            "it holds a user, a password, a query or a fragment, which would be recorded (credentials belong in the "
            "environment, as AWS_ACCESS_KEY_ID for s3://)"
        )
    if not re.fullmatch(URL, url) or "::" in url or not place.strip("/"):
        return "it is not of the form scheme://place/folder"
    if scheme in _OF_ONE_PROCESS:
        return f"what is under {scheme}:// is in the memory of one process, and those that fit the units cannot read it"
    if scheme in {"file", "local"} and not place.startswith("/"):
        return "a path of this computer begins with a slash, as in file:///data/lab"
    return ""


def _checked(url: str) -> str:
    if url and (reason := refused_because(url)):
        text = f"the URL is refused: {{reason}}; give scheme, place and folder only, as {EXAMPLES}"
        raise PydanticCustomError(REFUSED, text, {"reason": reason})
    return url


#: A URL of a storage in a request; empty: none. It never holds credentials.
StorageUrl = Annotated[
    str, AfterValidator(_checked), Field(json_schema_extra={"pattern": f"^$|{URL}", "maxLength": MAX_URL_CHARACTERS})
]
