"""API keys and roles: who may look, who may act, who may approve."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from datetime import datetime

from labctl.answers.admin import Caller, KeyRequest, KeyResponse, NewKeyResponse, Role
from labctl.errors import BadInput, NotAllowed, NotIdentified
from labctl.services.joint_reads import JointReads
from labctl.store import KeyRow, Store

PREFIX = "labctl_"
#: Of a key's random part. 256 bits cannot be guessed, so a slow hash would add nothing but time to every request.
RANDOM_BYTES = 32
SCHEME = "bearer"


def create_key(store: Store, request: KeyRequest, at: datetime) -> NewKeyResponse:
    """Make a key and keep its digest. Raises Conflict when the name was used before."""
    key = PREFIX + secrets.token_urlsafe(RANDOM_BYTES)
    row = store.keys.add(request.name, request.role.value, digest_of(key), at)
    return NewKeyResponse(**_shown(row).model_dump(), key=key)


def revoke_key(store: Store, name: str, reason: str, at: datetime) -> KeyResponse:
    """Take a key's power away; the next request with it is refused. Raises NotFound, Conflict."""
    return _shown(store.keys.revoke(name, reason, at))


def list_keys(store: Store) -> list[KeyResponse]:
    """Return every key that was made, by name."""
    return [_shown(row) for row in store.keys.all()]


def _shown(row: KeyRow) -> KeyResponse:
    return KeyResponse(name=row.name, role=Role(row.role), created_at=row.created_at, revoked_at=row.revoked_at)


def digest_of(key: str) -> str:
    """Return what is kept of a key."""
    return hashlib.sha256(key.encode("utf-8", "surrogatepass")).hexdigest()


async def identify(keys: JointReads[str, KeyRow], authorization: str) -> Caller:
    """Return whose key an Authorization header carries; `keys` reads keys by their digests. Raises NotIdentified."""
    scheme, _, key = authorization.partition(" ")
    digest = digest_of(key.strip())
    row = await keys.get(digest) if scheme.lower() == SCHEME else None
    if row is None or row.revoked_at is not None or not hmac.compare_digest(row.digest, digest):
        raise unknown_key()
    return Caller(row.name, Role(row.role), "key")


def unknown_key() -> NotIdentified:
    """Return the error for a key that is not in force."""
    return NotIdentified(
        "the API key is unknown or revoked; send `Authorization: Bearer KEY`; "
        "`labctl key create NAME --role ROLE` makes one"
    )


def require_role(caller: Caller, needed: Role) -> None:
    """Raise NotAllowed when a caller's role does not reach as far as an act needs."""
    if not caller.role.may(needed):
        raise NotAllowed(
            f"key {caller.name} has the role {caller.role.value}, but this request needs the role "
            f"{needed.value}; use a key with that role"
        )


def require_an_api_key(store: Store, why: str) -> None:
    """Raise BadInput when a service has to ask for keys and none is in force; `why` says what makes it ask."""
    if all(row.revoked_at is not None for row in store.keys.all()):
        raise BadInput(f"{why}, but no API key exists yet; make one first: labctl key create NAME --role operator")
