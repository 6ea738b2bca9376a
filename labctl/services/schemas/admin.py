"""API keys and roles, the audit trail, checks and backups."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Annotated

from pydantic import Field, JsonValue, StringConstraints

from labctl.services.schemas.base import Request, ResponseModel


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
        description="Name of the key's owner, shown in the audit trail; a name cannot be used for a second key."
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


class AuditResponse(ResponseModel):
    """One act: who did what, when, and why."""

    id: int
    at: datetime
    who: str
    action: str
    subject: str
    detail: dict[str, JsonValue] = Field(description="Details of the action; the keys depend on `action`.")
    hash: str


class AuditVerificationResponse(ResponseModel):
    """Whether the trail is whole; note the anchor in a place that no user of this database can write to."""

    ok: bool
    rows: int
    anchor: str | None
    row: int | None = None
    text: str = ""


class BackupNote(Request):
    """A backup that was made, for the audit trail; nothing is opened by this name."""

    file: str = Field(min_length=1, max_length=255)
    bytes: int = Field(ge=0)
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")


class FindingResponse(ResponseModel):
    """Damage that was found."""

    part: str
    text: str


class CheckResponse(ResponseModel):
    """What was checked, and what was found."""

    ok: bool
    database: str
    blocks: int
    calibrations: int
    audit_rows: int
    manifests: int = Field(default=0, description="Manifests in the chain.")
    not_sealed: int = Field(default=0, description="Records without a manifest because they are still changing.")
    signed: int = Field(
        default=0, description="How many manifests signatures cover; verified only if a public key was given."
    )
    verified: bool = Field(default=False, description="Whether the signatures were verified with a public key.")
    keys: list[str] = Field(default=[], description="Fingerprints (SHA-256) of the keys that signatures name.")
    anchor: str | None = Field(default=None, description="End of the chain, LENGTH:HASH; keep it in another place.")
    remarks: list[str] = Field(default=[], description="What was not checked, and why.")
    kept_readings: list[str] = Field(
        default=[],
        description="Readings that live calibrations left beside the database and that are in no recording, each with "
        "the command that imports it; no damage.",
    )
    findings: list[FindingResponse]


class BackupResponse(ResponseModel):
    """A backup that is on the disk."""

    file: str
    bytes: int
    sha256: str
    noted: bool
    remark: str = ""
    anchor: str | None = Field(default=None, description="End of the chain of manifests in the copy, LENGTH:HASH.")
    findings: list[FindingResponse]


class MigrationResponse(ResponseModel):
    """A database that stands at today's schema."""

    database: str
    from_schema: str
    to_schema: str
    copied_to: str | None = Field(default=None, description="Copy of the database as it was before.")
    bytes: int | None = None
    sha256: str | None = None


class SealKeyResponse(ResponseModel):
    """A key that signs manifests; the private key is never shown."""

    fingerprint: str = Field(description="SHA-256 of the public key in DER form.")
    public_key: str = Field(description="Public key in PEM form.")
    file: str | None = Field(default=None, description="File of the private key.")
    public_file: str | None = None


class SignedResponse(ResponseModel):
    """What was signed."""

    signed: int | None = Field(description="Number of the manifest that was signed; null: it is signed already.")
    fingerprint: str


class PluginResponse(ResponseModel):
    """One entry point of an installed distribution."""

    group: str
    name: str
    distribution: str
    version: str
    target: str = Field(description="module:object")
    problem: str = Field(default="", description="Why the entry point cannot be used; empty if it can.")


class DriverCheckResponse(ResponseModel):
    """One thing that every driver must do."""

    check: str
    problem: str = Field(default="", description="How the driver fails this check; empty: it passes.")


class DescribedCheckResponse(ResponseModel):
    """One request of a description, or one action."""

    what: str = Field(description="Key of the description, or the action.")
    answer: str = Field(
        default="", description="What the instrument answered; for a request that was not sent, its text."
    )
    problem: str = Field(default="", description="What was wrong; empty: nothing.")


class DescriptionTestResponse(ResponseModel):
    """A description of an instrument, tried on an address; without an address only its document was checked."""

    file: str
    name: str
    kind: str
    address: str | None = Field(default=None, description="Null: nothing was sent.")
    ok: bool
    checks: list[DescribedCheckResponse]
    wire_log: str | None = Field(
        default=None, description="File with every byte between labctl and the instrument; null: none was kept."
    )


class DriverTestResponse(ResponseModel):
    """A driver, tried on its simulator."""

    driver: str
    distribution: str
    version: str
    ok: bool
    checks: list[DriverCheckResponse]
