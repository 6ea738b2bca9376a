"""API keys and roles, the audit trail, checks and backups."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Annotated

from pydantic import Field, JsonValue, StringConstraints

from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import (
    ActTime,
    Distribution,
    DistributionVersion,
    DriverName,
    FileHash,
    FileName,
    FileSize,
)


class Role(StrEnum):
    """What a key may do; each may also do what those before it may."""

    VIEWER = "viewer"  #: read
    OPERATOR = "operator"  #: import, fit, improve, run campaigns
    APPROVER = "approver"  #: certify, revoke, make and revoke keys

    def may(self, needed: Role) -> bool:
        """Return whether this role reaches as far as another."""
        return _RANKS[self] >= _RANKS[needed]


_RANKS = {role: rank for rank, role in enumerate(Role)}


@dataclass(frozen=True)
class Caller:
    """Who asks, and what they may do."""

    name: str
    role: Role
    via: str


#: What a role permits, in the description of a key.
ROLE = (
    "What the key may do. viewer: read; operator: also import, fit, improve and run campaigns; approver: also certify, "
    "revoke, and make and revoke keys."
)


class KeyRequest(Request):
    """A key to make."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._@-]{0,99}$")] = Field(
        description="Name of the key's owner, shown in the audit trail; a name cannot be used for a second key."
    )
    role: Role = Field(description=ROLE)


class KeyResponse(ResponseModel):
    """A key as it may be seen later: without the key."""

    name: str = Field(description="Name of the key's owner, as in the audit trail.")
    role: Role = Field(description=ROLE)
    created_at: datetime = Field(description="Time at which the key was made.")
    revoked_at: datetime | None = Field(description="Time at which the key was revoked; null: it is in force.")


class NewKeyResponse(KeyResponse):
    """A key that was just made. This is the only time that it is shown."""

    key: str = Field(description="The key itself, to be sent with every request; only a hash of it is stored.")


class AuditResponse(ResponseModel):
    """One act: who did what, when, and why."""

    id: int = Field(description="Number of the row in the audit trail, from 1.")
    at: ActTime
    who: str = Field(
        description="Name of the person, from the API key, from `by` or from the command line; `labctl`: the program "
        "itself."
    )
    action: str = Field(description="Kind of act, such as `certify` or `campaign state`.")
    subject: str = Field(description="What was acted on, such as a unit, a version, a campaign or a key.")
    detail: dict[str, JsonValue] = Field(description="Details of the action; the keys depend on `action`.")
    hash: str = Field(description="SHA-256 of this row and of the hash of the row before it.")


class AuditVerificationResponse(ResponseModel):
    """Whether the trail is whole; note the anchor in a place that no user of this database can write to."""

    ok: bool = Field(
        description="Whether every row agrees with its hash, with the row before it and with the anchor, if one "
        "was given."
    )
    rows: int = Field(description="Number of rows of the trail.")
    anchor: str | None = Field(
        description="End of the trail, LENGTH:HASH, to be kept elsewhere; null: the trail is empty or damaged."
    )
    row: int | None = Field(default=None, description="Number of the first row that is damaged; null: none is.")
    text: str = Field(default="", description="What is wrong with that row; empty: nothing.")


class BackupNote(Request):
    """A backup that was made, for the audit trail; nothing is opened by this name."""

    file: str = Field(min_length=1, max_length=255, description="Name of the file of the backup, without its folder.")
    bytes: FileSize = Field(ge=0)
    sha256: FileHash = Field(pattern=r"^[0-9a-f]{64}$")


class DamageResponse(ResponseModel):
    """Damage that was found."""

    part: str = Field(description="Part of the database that is damaged.")
    text: str = Field(description="What is damaged, and where.")


class CheckResponse(ResponseModel):
    """What was checked, and what was found."""

    ok: bool = Field(description="Whether no damage was found.")
    database: str = Field(description="Path or URL of the database that was checked.")
    blocks: int = Field(description="Number of blocks of readings that were checked.")
    calibrations: int = Field(description="Number of calibration versions that were checked.")
    audit_rows: int = Field(description="Number of rows of the audit trail that were checked.")
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
    findings: list[DamageResponse] = Field(description="Damage that was found; empty: none.")


class BackupResponse(ResponseModel):
    """A backup that is on the disk."""

    file: str = Field(description="Path of the copy.")
    bytes: FileSize
    sha256: FileHash
    noted: bool = Field(description="Whether the backup was entered in the audit trail.")
    remark: str = Field(
        default="", description="Why the backup could not be entered in the audit trail; empty: it was."
    )
    anchor: str | None = Field(default=None, description="End of the chain of manifests in the copy, LENGTH:HASH.")
    findings: list[DamageResponse] = Field(description="Damage that the check of the copy found; empty: none.")


class MigrationResponse(ResponseModel):
    """A database that stands at today's schema."""

    database: str = Field(description="Path or URL of the database.")
    from_schema: str = Field(description="Revision of the schema before the migration.")
    to_schema: str = Field(description="Revision of the schema after the migration.")
    copied_to: str | None = Field(default=None, description="Copy of the database as it was before.")
    bytes: int | None = Field(default=None, description="Size of that copy in bytes; null: no copy was made.")
    sha256: str | None = Field(default=None, description="SHA-256 of that copy; null: no copy was made.")


class MoveResponse(ResponseModel):
    """A database that was brought into another one."""

    source: str = Field(description="Path or URL of the database that was read; it is as it was.")
    target: str = Field(description="Path or URL of the database that has its rows now.")
    tables: int = Field(description="Number of tables.")
    rows: int = Field(description="Number of rows, each compared with the source after it was written.")
    kept: int = Field(description="Rows that an earlier move, which was interrupted, had brought.")
    sha256: str = Field(description="SHA-256 of all rows as both databases store them.")
    check: CheckResponse = Field(description="Check of the target after the move.")


class SealKeyResponse(ResponseModel):
    """A key that signs manifests; the private key is never shown."""

    fingerprint: str = Field(description="SHA-256 of the public key in DER form.")
    public_key: str = Field(description="Public key in PEM form.")
    file: str | None = Field(default=None, description="File of the private key.")
    public_file: str | None = Field(default=None, description="File of the public key; null: none was written.")


class SignedResponse(ResponseModel):
    """What was signed."""

    signed: int | None = Field(description="Number of the manifest that was signed; null: it is signed already.")
    fingerprint: str = Field(description="SHA-256 of the public key in DER form.")


class PluginResponse(ResponseModel):
    """One entry point of an installed distribution."""

    group: str = Field(description="Group of the entry point, which states what kind of extension it is.")
    name: str = Field(description="Name of the entry point in its group.")
    distribution: str = Field(description="Python distribution (installed package) that declares the entry point.")
    version: DistributionVersion
    target: str = Field(description="module:object")
    problem: str = Field(default="", description="Why the entry point cannot be used; empty if it can.")


class DriverCheckResponse(ResponseModel):
    """One thing that every driver must do."""

    check: str = Field(description="What was checked.")
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

    file: FileName
    name: str = Field(description="Name of the described instrument.")
    kind: str = Field(description="Kind of instrument that is described.")
    address: str | None = Field(default=None, description="Null: nothing was sent.")
    ok: bool = Field(description="Whether no check found a problem.")
    checks: list[DescribedCheckResponse] = Field(description="Each request and action that was tried.")
    wire_log: str | None = Field(
        default=None, description="File with every byte between labctl and the instrument; null: none was kept."
    )


class DriverTestResponse(ResponseModel):
    """A driver, tried on its simulator."""

    driver: DriverName
    distribution: Distribution
    version: DistributionVersion
    ok: bool = Field(description="Whether the driver passes every check.")
    checks: list[DriverCheckResponse] = Field(description="Each check with its result.")
