"""API keys and roles: who may look, who may act, who may approve."""

from __future__ import annotations

import hashlib
import hmac
import secrets
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Annotated

from pydantic import Field, StringConstraints

from labctl.errors import BadInput, NotAllowed, NotIdentified
from labctl.services.commands.protocol import Request
from labctl.services.schemas.answers import ResponseModel
from labctl.store import KeyRow, Store

PREFIX = "labctl_"
#: Of a key's random part. Nobody guesses 256 bits, so a slow hash would add nothing but time to every request.
RANDOM_BYTES = 32
SCHEME = "bearer"


class Role(StrEnum):
    """What a key may do; each may also do what those before it may."""

    VIEWER = "viewer"  #: read
    OPERATOR = "operator"  #: import, fit, improve, run campaigns
    APPROVER = "approver"  #: certify, revoke, make and revoke keys

    def may(self, needed: Role) -> bool:
        """Return whether this role reaches as far as another."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True)
class Caller:
    """Who asks, and what they may do."""

    name: str
    role: Role
    via: str


class KeyRequest(Request):
    """A key to make."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._@-]{0,99}$")] = Field(
        description="Whose it is: the name that the audit trail will show. Used once."
    )
    role: Role


class KeyResponse(ResponseModel):
    """A key as it may be seen later: without the key."""

    name: str
    role: Role
    created_at: datetime
    revoked_at: datetime | None


class NewKeyResponse(KeyResponse):
    """A key that was just made. This is the only time that it is shown."""

    key: str


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


def identify(store: Store, authorization: str) -> Caller:
    """Return whose key an Authorization header carries. Raises NotIdentified."""
    scheme, _, key = authorization.partition(" ")
    digest = digest_of(key.strip())
    row = store.keys.by_digest(digest) if scheme.lower() == SCHEME else None
    if row is None or row.revoked_at is not None or not hmac.compare_digest(row.digest, digest):
        raise NotIdentified(
            "the key is not one in force here (unknown or revoked); send `Authorization: Bearer KEY`; "
            "`labctl key create NAME --role ROLE` makes one"
        )
    return Caller(row.name, Role(row.role), "key")


def require_role(caller: Caller, needed: Role) -> None:
    """Raise NotAllowed when a caller's role does not reach as far as an act needs."""
    if not caller.role.may(needed):
        raise NotAllowed(f"{caller.name} is {caller.role.value}; this asks for the role {needed.value}")


def require_an_api_key(store: Store, why: str) -> None:
    """Raise BadInput when a service has to ask for keys and none is in force; `why` says what makes it ask."""
    if all(row.revoked_at is not None for row in store.keys.all()):
        raise BadInput(f"{why}, and there is no key to ask for; make one first: labctl key create NAME --role operator")
