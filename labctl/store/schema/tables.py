"""Every table, with the metadata that they are all in."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.calibrations import (
    calibration_fetches,
    calibration_recordings,
    calibrations,
    certifications,
    release_requests,
)
from labctl.store.schema.campaigns import campaigns, events, steps, timed_runs
from labctl.store.schema.recordings import data_set_means, data_sets, environment, recordings, sample_blocks
from labctl.store.schema.standards import (
    check_gyros,
    standard_certificates,
    standard_checks,
    standard_findings,
    standards,
)
from labctl.store.schema.types import Instant, RowId, id_column, metadata

#: Campaigns that are to begin later. `due_at` is the next start; a single start keeps its time once it is over.
scheduled_starts = sa.Table(
    "scheduled_starts",
    metadata,
    id_column(),
    sa.Column("bench_name", sa.String(200), nullable=False),
    sa.Column("recipe_name", sa.String(200), nullable=False),
    sa.Column("recipe", sa.Text, nullable=False),
    sa.Column("clip", sa.Boolean, nullable=False),
    sa.Column("priority", sa.Integer, nullable=False),
    sa.Column("cron", sa.String(200)),
    sa.Column("time_zone", sa.String(100), nullable=False),
    sa.Column("late_limit_s", sa.Float),
    sa.Column("due_at", Instant, nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("confirmed_by", sa.String(200)),  # who confirmed that the bench will be clear
    sa.Column("visits_s", sa.JSON),  # when the plan needs a person, s from its begin
    sa.Column("hide", sa.JSON(none_as_null=True)),  # effects hidden in the units of a simulated bench
    sa.Column("fit", sa.Boolean, nullable=False, server_default=sa.true()),  # whether it ends in a draft
    sa.Index(None, "bench_name", "state", "due_at"),
)

#: What became of each start that fell due. `after_campaign` is the newest campaign at the time it was claimed.
start_events = sa.Table(
    "start_events",
    metadata,
    id_column(),
    sa.Column("start_id", RowId, sa.ForeignKey("scheduled_starts.id"), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("due_at", Instant, nullable=False),
    sa.Column("outcome", sa.String(20), nullable=False),
    sa.Column("message", sa.Text, nullable=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id")),
    sa.Column("after_campaign", RowId, nullable=False),
    sa.Index(None, "start_id", "id"),
)


#: As they were issued, in all three forms: a later release of labctl or typst changes none of them.
certificates = sa.Table(
    "certificates",
    metadata,
    id_column(),
    sa.Column("number", sa.String(100), nullable=False, unique=True),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("replaces", sa.String(100)),
    sa.Column("reason", sa.Text, nullable=False),  #: of an amendment; empty of the first
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100)),  #: API key of the one who issued it; absent: the name is as typed
    sa.Column("at", Instant, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("order", sa.JSON, nullable=False),  #: the facts that were given with the request
    sa.Column("document", sa.LargeBinary, nullable=False),
    sa.Column("xml", sa.LargeBinary, nullable=False),
    sa.Column("pdf", sa.LargeBinary, nullable=False),
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
    sa.UniqueConstraint("replaces"),
    sa.Index(None, "serial", "id"),
)

#: A certificate that is withdrawn stays so; rows are only ever added.
certificate_withdrawals = sa.Table(
    "certificate_withdrawals",
    metadata,
    id_column(),
    sa.Column("number", sa.String(100), sa.ForeignKey("certificates.number"), nullable=False, unique=True),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100)),  #: as of a certificate
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    #: The newest act on the version then: the revocation that withdrew it, or the certification that stays.
    sa.Column("certification_id", RowId, sa.ForeignKey("certifications.id")),
)


#: Rows are only ever added, numbered from 1 without a gap; `document` holds the hash of the row before.
manifests = sa.Table(
    "manifests",
    metadata,
    sa.Column("sequence", RowId, primary_key=True, autoincrement=False),
    sa.Column("kind", sa.String(20), nullable=False),  #: of the record; empty where only the audit trail grew
    sa.Column("record", sa.String(300), nullable=False),
    sa.Column("act", sa.String(10), nullable=False),  #: sealed, reopened, audit
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("document", sa.LargeBinary, nullable=False),
    sa.Column("signature", sa.LargeBinary),  #: over the hash, and so over all rows before; absent: not signed by itself
    sa.Column("signed_by", sa.String(64)),  #: fingerprint of the public key
    sa.Index(None, "kind", "record", "sequence"),
)

#: One row: how many manifests there are and the hash of the last, so that removing the last ones shows.
manifest_head = sa.Table(
    "manifest_head",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("length", sa.BigInteger, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
)

#: Digests of the columns of a block of readings, made when it is packed for good: sealing need not unpack it again.
block_digests = sa.Table(
    "block_digests",
    metadata,
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True, autoincrement=False),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("seq", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("readings", sa.String(64), nullable=False),
    sa.Column("temperatures", sa.String(64), nullable=False),
    sa.Column("table_rates", sa.String(64), nullable=False),
)


benches = sa.Table(
    "benches",
    metadata,
    sa.Column("name", sa.String(200), primary_key=True),
    sa.Column("file", sa.JSON, nullable=False),
    sa.Column("last_used_at", Instant, nullable=False),
    sa.Column(
        "unconfirmed", sa.Text, nullable=False, server_default=""
    ),  #: what the safe state could not confirm; until a person clears it
    sa.Column("unconfirmed_at", Instant),
    sa.Column("attempts", sa.Integer, nullable=False, server_default="0"),  #: at the safe state, since then
    sa.Column("attempted_at", Instant),
    sa.Column("confirmed_at", Instant),  #: when such an attempt confirmed it; a person has still to look
)

leases = sa.Table(
    "leases",
    metadata,
    sa.Column("bench_name", sa.String(200), primary_key=True),
    sa.Column("owner", sa.String(32), nullable=False),
    sa.Column("host", sa.String(200), nullable=False),
    sa.Column("machine", sa.String(200), nullable=False),
    sa.Column("pid", sa.BigInteger, nullable=False),
    sa.Column("since", Instant, nullable=False),
    sa.Column("beat", sa.BigInteger, nullable=False),
    sa.Column("beat_at", Instant, nullable=False),
    sa.Column("expires_at", Instant, nullable=False),
    sa.Column("url", sa.Text),  #: of the service that drives the bench; null where a terminal does
    sa.Column("calls", sa.Text),  #: folder of the Unix sockets of its bench process
)


audit = sa.Table(
    "audit",
    metadata,
    id_column(),
    sa.Column("at", Instant, nullable=False),
    sa.Column("actor", sa.String(200), nullable=False),
    sa.Column("action", sa.String(60), nullable=False),
    sa.Column("subject", sa.String(300), nullable=False),
    sa.Column("detail", sa.JSON, nullable=False),
    sa.Column("previous_hash", sa.String(64), nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
)

#: One row: how long the trail is and the hash of its last row, so that cutting rows off its end shows.
audit_head = sa.Table(
    "audit_head",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("length", sa.BigInteger, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
)


#: Written with the plan of a campaign whose recipe has [fit]. State: due, fitted (the version is kept, its report is
#: not), made, failed.
drafts = sa.Table(
    "drafts",
    metadata,
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True, autoincrement=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("version", sa.Integer),
    sa.Column("at", Instant),
    sa.Column("reason", sa.Text, nullable=False, server_default=""),  #: why there is none
    sa.Column("report", sa.JSON(none_as_null=True)),
    sa.Index(None, "campaign_id"),
    sa.Index(None, "serial", "recording_id"),
    sa.Index(None, "state"),
)


sensor_versions = sa.Table(
    "sensor_versions",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("sensor", sa.String(20), nullable=False),  #: accelerometer or magnetometer
    sa.Column("version", sa.Integer, nullable=False),  #: from 1, per serial number and sensor
    sa.Column("verdict", sa.String(20), nullable=False),
    sa.Column("data", sa.JSON, nullable=False),  #: how the files were read, and the name and SHA-256 of each
    sa.Column("document", sa.LargeBinary, nullable=False),  #: canonical JSON of the result with its covariance
    sa.Column("hash", sa.String(64), nullable=False),  #: SHA-256 of the document
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100)),  #: API key of the one who acted; absent: the name is as typed
    sa.Column("at", Instant, nullable=False),
    sa.UniqueConstraint("serial", "sensor", "version"),
)


room_environment = sa.Table(
    "room_environment",
    metadata,
    id_column(),
    sa.Column("measured_at", Instant, nullable=False),
    sa.Column("bench_name", sa.String(200), nullable=False),  #: empty: of all benches of the laboratory
    sa.Column("quantity", sa.String(20), nullable=False),
    sa.Column("unit", sa.String(10), nullable=False),
    sa.Column("value", sa.Float, nullable=False),
    sa.Column("source", sa.String(200), nullable=False),  #: the instrument, or the person who read it
    sa.Column("at", Instant, nullable=False),
    sa.Index(None, "measured_at"),
)


#: A key itself is never kept. Names are not used twice, so that a name in the audit trail stays one key.
api_keys = sa.Table(
    "api_keys",
    metadata,
    sa.Column("name", sa.String(100), primary_key=True),
    sa.Column("role", sa.String(20), nullable=False),
    sa.Column("digest", sa.String(64), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("revoked_at", Instant),
    sa.UniqueConstraint("digest"),
)


units = sa.Table(
    "units",
    metadata,
    sa.Column("serial", sa.String(200), primary_key=True),
    sa.Column("model", sa.String(200), nullable=False),
    sa.Column("technology", sa.String(20)),
    sa.Column("first_seen_at", Instant, nullable=False),
)


__all__ = [
    "Instant",
    "api_keys",
    "audit",
    "audit_head",
    "benches",
    "block_digests",
    "calibration_fetches",
    "calibration_recordings",
    "calibrations",
    "campaigns",
    "certificate_withdrawals",
    "certificates",
    "certifications",
    "check_gyros",
    "data_set_means",
    "data_sets",
    "drafts",
    "environment",
    "events",
    "leases",
    "manifest_head",
    "manifests",
    "metadata",
    "recordings",
    "release_requests",
    "room_environment",
    "sample_blocks",
    "scheduled_starts",
    "sensor_versions",
    "standard_certificates",
    "standard_checks",
    "standard_findings",
    "standards",
    "start_events",
    "steps",
    "timed_runs",
    "units",
]
