"""Release by a second person: where it is asked for, a version is certified by two keys, never by one.

The identity of a person is the key. A name that is typed, or the account of the operating system, is none: one person
can have several.
"""

from __future__ import annotations

from datetime import datetime

from labctl import config
from labctl.acting_user import acting_key
from labctl.answers.certification import CertifyRequest, ReleaseRequestResponse
from labctl.errors import BadInput, Conflict, NotFound
from labctl.store import NewReleaseRequest, ReleaseRequestRow, Store


class ReleaseRefused(Conflict):
    """A version may not be certified by this person, or in this way; the text says why, and what to do."""

    slug = "release-refused"


def needs_second_person() -> bool:
    """Return whether this service certifies only what a second person releases. Raises BadInput."""
    text = config.variable(config.TWO_PERSON_VARIABLE)
    if text not in {"", "0", "1"}:
        raise BadInput(
            f"${config.TWO_PERSON_VARIABLE} = {text[:40]!r}: give 1 where a second person has to release every "
            "version, 0 where not, or unset the variable"
        )
    return text == "1"


def key_of_person(what: str) -> str:
    """Return the key by which a person acts now. Raises ReleaseRefused where there is none."""
    key = acting_key()
    if key is None:
        raise ReleaseRefused(
            f"{what} needs an API key here, since two persons have to certify a version (${config.TWO_PERSON_VARIABLE} "
            "= 1) and a name alone proves no person; start the service with --require-keys and send the key of an "
            "approver"
        )
    return key


def ask_for_release(
    store: Store, serial: str, version: int, request: CertifyRequest, at: datetime
) -> ReleaseRequestResponse:
    """Keep what a first person asks to certify, at an aware time; nothing is in force by it. Raises ReleaseRefused."""
    key = key_of_person(f"certifying {serial} version {version}")
    new = NewReleaseRequest(
        serial, version, request.by, key, request.reason, at, request.due_days, request.override
    )  # fmt: skip
    return response(store.release_requests.add(new))


def waiting_request(store: Store, serial: str, version: int, key: str) -> ReleaseRequestRow:
    """Return what waits for a release by the person with `key`. Raises NotFound, ReleaseRefused for the first one."""
    request = next((row for row in store.release_requests.waiting(serial) if row.version == version), None)
    if request is None:
        raise NotFound(
            f"{serial} version {version} does not wait for a release; `labctl certify {serial} {version}` asks for one"
        )
    if request.by_key == key:
        raise ReleaseRefused(
            f"key {key!r} asked for the certification of {serial} version {version}, as {request.by}; a second person "
            "has to release it with another key"
        )
    return request


def list_waiting(store: Store, serial: str) -> list[ReleaseRequestResponse]:
    """Return what waits for a second person, newest first. Raises NotFound."""
    return [response(row) for row in store.release_requests.waiting(store.units.get(serial).serial)]


def response(row: ReleaseRequestRow) -> ReleaseRequestResponse:
    """Return a request as an answer."""
    return ReleaseRequestResponse(
        serial=row.serial, version=row.version, by=row.by, by_key=row.by_key, reason=row.reason, at=row.at,
        due_days=row.due_days, override=row.override,
    )  # fmt: skip
