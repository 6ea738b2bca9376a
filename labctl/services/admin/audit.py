"""The audit trail: read, verified, and anchored elsewhere."""

from __future__ import annotations

from datetime import UTC, datetime

from labctl.answers.admin import AuditResponse, AuditVerificationResponse
from labctl.errors import BadInput
from labctl.store import Head, Store


def list_audit(store: Store, since: datetime | None = None, after: int = 0, limit: int = 1000) -> list[AuditResponse]:
    """Return acts in order: from an instant on, with a number above `after`, at most `limit`."""
    since = since.replace(tzinfo=UTC) if since is not None and since.tzinfo is None else since
    return [
        AuditResponse(
            id=row.id, at=row.at, who=row.who, action=row.action, subject=row.subject, detail=dict(row.detail),
            hash=row.hash,
        )
        for row in store.audit.rows(since=since, after=after, limit=limit)
    ]  # fmt: skip


def anchor_of(text: str) -> Head:
    """Read an anchor, `LENGTH:HASH`, as verifying prints it. Raises BadInput."""
    length, _, digest = text.partition(":")
    if not (length.isascii() and length.isdigit()) or len(digest) != 64 or int(length) < 1:
        raise BadInput(f"--anchor {text!r}: expected LENGTH:HASH as `labctl audit verify` prints it")
    return Head(int(length), digest)


def verify_audit(store: Store, anchor: str | None = None) -> AuditVerificationResponse:
    """Check every row of the trail by its hash, the row before, the head and, if given, an anchor."""
    broken = store.audit.first_broken(anchor_of(anchor) if anchor else None)
    head = store.audit.head()
    rows = head.length if head is not None else 0
    anchor_text = f"{head.length}:{head.hash}" if head is not None and head.length else None
    if broken is None:
        return AuditVerificationResponse(ok=True, rows=rows, anchor=anchor_text)
    return AuditVerificationResponse(
        ok=False, rows=rows, anchor=None, row=broken.row, text=f"row {broken.row}: {broken.what}"
    )
