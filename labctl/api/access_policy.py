"""Who may call the API, and with how much: keys, host names, sizes, roles."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fastapi import Depends, Request, Security
from fastapi.security import HTTPBearer

from labctl.answers.admin import Role
from labctl.errors import ReadOnly
from labctl.services.admin.api_keys import require_role
from labctl.services.read_access import acting_service

READING = frozenset({"GET", "HEAD", "OPTIONS"})
#: Paths that may need a computation; everything else that is read is a file or a few figures.
API = "/api/"
#: Answered without a key: a load balancer asks the first, every open page the second.
OPEN = frozenset({"/health", "/health/heartbeat"})
#: Answered without a key to a request that shows by its content that it may ask: with the hash on a certificate.
PROVEN = frozenset({"/api/certificates/state"})
#: Queries that are sent by POST because of what they carry: nothing changes, so a viewer may.
ASKING = (
    "/api/plans",
    "/api/designs",
    "/api/designs/evaluation",
    "/api/units/{serial}/calibrations/{version}/preview",
    "/api/recordings/logs/preview",
)
#: Requests that stop a bench: their key is looked up in memory, as the database may be what does not answer.
STOPS = re.compile(r"/api/(?:stop|campaigns/[^/]+/abort)")
_ASKED = re.compile("|".join(re.sub(r"{\w+}", "[^/]+", path) for path in ASKING))
#: Where files are sent: a recording, a log, and a log to preview.
UPLOAD = "/api/recordings"
UPLOADS = frozenset({UPLOAD, "/api/recordings/logs", "/api/recordings/logs/preview"})
MIB = 1 << 20


@dataclass(frozen=True)
class ReadOnlyAccess:
    """The access to a service that only reads."""

    acts_at: str | None = None  #: address of the service that acts, where it is known

    def refuse_act(self, method: str, path: str) -> None:
        """Raise ReadOnly for a request that would change something, whatever the role of its caller."""
        if role_needed(method, path) is not Role.VIEWER:
            raise ReadOnly(
                f"{method} {path}: this service is read-only, nothing was changed and nothing was stopped; send the "
                f"request to {acting_service(self.acts_at)}",
                self.acts_at,
            )


@dataclass(frozen=True)
class AccessPolicy:
    """Which callers are admitted, and the largest body of a request.

    Without keys the only callers are this machine's, so a request must have been sent to this machine by name: a page
    of another origin that a browser here happens to show is not a caller. `hosts` are the names that are answered to;
    None: any, for an application that nothing listens for.
    """

    keys: bool = False
    hosts: frozenset[str] | None = None
    body_bytes: int = MIB
    upload_bytes: int = 2048 * MIB
    held_bytes: int = 64 * MIB  #: of bodies that are held in memory for all requests together
    read_only: ReadOnlyAccess | None = None  #: None: requests may change something

    def largest_body(self, path: str) -> int:
        """Return the largest body of a request to a path, in bytes."""
        return self.upload_bytes if path in UPLOADS else self.body_bytes


def role_needed(method: str, path: str) -> Role:
    """Return the role that a request needs by its method; a route may need more."""
    asked = method == "POST" and _ASKED.fullmatch(path) is not None
    return Role.VIEWER if asked or method in READING else Role.OPERATOR


def _approver(request: Request) -> None:
    require_role(request.state.caller, Role.APPROVER)


#: For `dependencies=[...]` of a route that needs more than its method says.
NEEDS_APPROVER = Depends(_approver)

#: For `dependencies=[...]`: declares in the description that a key may be sent, which its page asks for under
#: "Authorize". Who is admitted is decided before a route is reached, so nothing is refused here.
DECLARES_KEY = Security(
    HTTPBearer(
        scheme_name="key",
        description="An API key made by `labctl key create`. A service on loopback (127.0.0.1) without "
        "--require-keys needs no key.",
        auto_error=False,
    )
)
