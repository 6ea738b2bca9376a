"""The tables. Portable types and named constraints only; instants are aware UTC, kept as whole microseconds."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

import sqlalchemy as sa
from sqlalchemy.engine import Dialect

metadata = sa.MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class Instant(sa.TypeDecorator[datetime]):
    """An aware instant as whole microseconds since 1970; a naive datetime is refused."""

    impl = sa.BigInteger
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> int | None:  # noqa: ARG002
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"an instant needs a time zone: {value!r}")
        return (value - EPOCH) // timedelta(microseconds=1)

    def process_result_value(self, value: Any, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        return None if value is None else EPOCH + timedelta(microseconds=int(value))


#: Whole numbers that count rows; SQLite numbers rows by itself only in a column of type INTEGER.
RowId = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def _id() -> sa.Column[int]:
    return sa.Column("id", RowId, primary_key=True, autoincrement=True)


def _recording() -> sa.Column[int]:
    return sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), nullable=False)


def _campaign() -> sa.Column[int]:
    return sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id"), nullable=False)


units = sa.Table(
    "units",
    metadata,
    sa.Column("serial", sa.String(200), primary_key=True),
    sa.Column("model", sa.String(200), nullable=False),
    sa.Column("technology", sa.String(20)),
    sa.Column("first_seen_at", Instant, nullable=False),
)

benches = sa.Table(
    "benches",
    metadata,
    sa.Column("name", sa.String(200), primary_key=True),
    sa.Column("file", sa.JSON, nullable=False),
    sa.Column("last_used_at", Instant, nullable=False),
    sa.Column(
        "unconfirmed", sa.Text, nullable=False, server_default=""
    ),  #: of the safe state; until a person clears it
    sa.Column("unconfirmed_at", Instant),
)

campaigns = sa.Table(
    "campaigns",
    metadata,
    _id(),
    sa.Column("recipe_name", sa.String(200), nullable=False),
    sa.Column("recipe", sa.JSON, nullable=False),
    sa.Column("bench_name", sa.String(200), sa.ForeignKey("benches.name"), nullable=False),
    sa.Column("bench", sa.JSON, nullable=False),
    sa.Column("schedule_hash", sa.String(64), nullable=False),
    sa.Column("expected_s", sa.Float, nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("reason", sa.Text, nullable=False, default=""),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("started_at", Instant),
    sa.Column("ended_at", Instant),
    sa.Column("added_runs", sa.Integer, nullable=False, server_default="0"),  #: powered sessions beyond the plan's
    sa.Column("powered_on_s", sa.Float),  #: when the present session began, campaign time
    sa.Column("boot_id", sa.String(64)),  #: of the host that runs it: another one means that the power failed
)

steps = sa.Table(
    "steps",
    metadata,
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id"), primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("kind", sa.String(20), nullable=False),
    sa.Column("body", sa.JSON, nullable=False),
    sa.Column("expected_s", sa.Float, nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("started_s", sa.Float),
    sa.Column("ended_s", sa.Float),
    sa.Column("started_at", Instant),
    sa.Column("ended_at", Instant),
    sa.Column("result", sa.JSON(none_as_null=True)),
)

events = sa.Table(
    "events",
    metadata,
    _id(),
    _campaign(),
    sa.Column("at", Instant, nullable=False),
    sa.Column("t_s", sa.Float, nullable=False),
    sa.Column("kind", sa.String(60), nullable=False),
    sa.Column("level", sa.String(10), nullable=False),
    sa.Column("message", sa.Text, nullable=False),
    sa.Column("device", sa.String(100)),
    sa.Column("value", sa.Float),
    sa.Column("limit_value", sa.Float),
    sa.Column("unit", sa.String(20)),
    sa.Index(None, "campaign_id", "id"),
)

recordings = sa.Table(
    "recordings",
    metadata,
    _id(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id")),
    sa.Column("gyro", sa.String(100)),
    sa.Column("kind", sa.String(20), nullable=False),
    sa.Column("info", sa.JSON, nullable=False),
    sa.Column("channels", sa.JSON, nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("dropped", sa.Text),  #: why the unit took no further part; absent while it does
    sa.Index(None, "serial", "id"),
)

data_sets = sa.Table(
    "data_sets",
    metadata,
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("reason", sa.Text, nullable=False, default=""),
    sa.Column("position", sa.String(2), nullable=False),
    sa.Column("run", sa.Integer, nullable=False),
    sa.Column("mounting", sa.Integer, nullable=False),
    sa.Column("table_rate_dps", sa.Float, nullable=False),
    sa.Column("asked_dps", sa.Float),
    sa.Column("table_angle_deg", sa.Float),
    sa.Column("chamber_setpoint_c", sa.Float),
    sa.Column("gate_from_s", sa.Float),
    sa.Column("gate_until_s", sa.Float),
    sa.Column("power_on_s", sa.Float),
    sa.Column("n", sa.Integer, nullable=False, default=0),
    sa.Column("lost", sa.Integer, nullable=False, default=0),
    sa.Column("damaged", sa.Integer, nullable=False, default=0),
    sa.Column("planned", sa.Integer),  #: its number in the plan: one that is redone has the same again
)

data_set_means = sa.Table(
    "data_set_means",
    metadata,
    sa.Column("recording_id", RowId, primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("channel", sa.String(60), primary_key=True),
    sa.Column("mean", sa.Float),
    sa.Column("std", sa.Float),
    sa.Column("white_std", sa.Float),
    sa.Column("n", sa.Integer, nullable=False),
    sa.ForeignKeyConstraint(["recording_id", "number"], ["data_sets.recording_id", "data_sets.number"]),
)

#: Number 0 holds a whole table of points or coefficients; the others are readings of a data set.
sample_blocks = sa.Table(
    "sample_blocks",
    metadata,
    _id(),
    _recording(),
    sa.Column("number", sa.Integer, nullable=False),
    sa.Column("seq", sa.Integer, nullable=False),
    sa.Column("n", sa.Integer, nullable=False),
    sa.Column("codec", sa.Integer, nullable=False),
    sa.Column("crc32", sa.BigInteger, nullable=False),
    sa.Column("data", sa.LargeBinary, nullable=False),
    sa.UniqueConstraint("recording_id", "number", "seq"),
)

environment = sa.Table(
    "environment",
    metadata,
    _id(),
    _recording(),
    sa.Column("t_s", sa.Float, nullable=False),
    sa.Column("run", sa.Integer, nullable=False),
    sa.Column("temperature_c", sa.Float, nullable=False),
    sa.Column("chamber_c", sa.Float),
    sa.Column("chamber_setpoint_c", sa.Float),
    sa.Index(None, "recording_id", "id"),
)

calibrations = sa.Table(
    "calibrations",
    metadata,
    _id(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("parent", sa.Integer),
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id")),
    sa.Column("model", sa.String(200), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("document", sa.LargeBinary, nullable=False),
    sa.Column("answer", sa.JSON, nullable=False),
    sa.UniqueConstraint("serial", "version"),
)

certifications = sa.Table(
    "certifications",
    metadata,
    _id(),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("act", sa.String(10), nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("due_at", Instant),
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
    sa.Index(None, "serial", "id"),
)

audit = sa.Table(
    "audit",
    metadata,
    _id(),
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

#: Campaigns that are to begin later. `due_at` is the next start that waits; a single start keeps its own when it ended.
scheduled_starts = sa.Table(
    "scheduled_starts",
    metadata,
    _id(),
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
    sa.Index(None, "bench_name", "state", "due_at"),
)

#: What became of each start that fell due. `after_campaign` is the newest campaign at the time it was claimed.
start_events = sa.Table(
    "start_events",
    metadata,
    _id(),
    sa.Column("start_id", RowId, sa.ForeignKey("scheduled_starts.id"), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("due_at", Instant, nullable=False),
    sa.Column("outcome", sa.String(20), nullable=False),
    sa.Column("message", sa.Text, nullable=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id")),
    sa.Column("after_campaign", RowId, nullable=False),
    sa.Index(None, "start_id", "id"),
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
)
