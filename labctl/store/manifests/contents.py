"""What a manifest covers of each kind of record: named parts, each a list of columns, and when a record is at rest.

The lists belong to the manifests of `labctl-manifest/1`, which exist: a list never changes. What a later schema adds to
a record becomes a part of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import sqlalchemy as sa

from labctl.store.schema import tables
from labctl.store.schema.types import Instant, StateOfCampaign
from procedures.contracts.campaign_state import ENDED

_T = tables


@dataclass(frozen=True)
class Part:
    """Some columns of the rows of a record, under one name."""

    name: str
    table: sa.Table
    of: str  #: the column that names the record
    columns: str
    order: str = ""
    only: Callable[[], sa.ColumnElement[bool]] = sa.true
    since: str = "0017"  #: schema that has these columns
    was_empty: bool = False  #: whether a record that was sealed before that schema had no such rows

    def query(self, record: int | str) -> sa.Select[*tuple[object, ...]]:
        """Return the query of its rows, as they are stored, in an order that does not depend on the database."""
        c = self.table.c
        chosen: sa.Select[*tuple[object, ...]] = sa.select(*(_stored(c[name]) for name in self.columns.split()))
        return chosen.where(c[self.of] == record, self.only()).order_by(*(c[name] for name in self.order.split()))


@dataclass(frozen=True)
class Kind:
    """One kind of record."""

    name: str
    table: sa.Table
    key: str
    parts: tuple[Part, ...]
    title: Callable[[sa.Row[*tuple[object, ...]]], str]  #: from the columns `titled`
    titled: str
    at_rest: Callable[[], sa.ColumnElement[bool]] = sa.true  #: whether nothing of the record is still to come
    whole: Callable[[], sa.ColumnElement[bool]] = field(default=sa.true)  #: whether it is there for others at all
    has_blocks: bool = False
    since: str = "0017"  #: schema that has the table

    def as_of(self, schema: str) -> Kind:
        """Return the kind with the parts that a schema has."""
        return replace(self, parts=tuple(part for part in self.parts if part.since <= schema))

    @property
    def is_numbered(self) -> bool:
        """Whether a record is named by its number."""
        return isinstance(self.table.c[self.key].type, sa.Integer | sa.BigInteger)

    def key_of(self, record: str) -> int | str:
        """Return the key of a record in its table."""
        return int(record) if self.is_numbered else record


def _stored(column: sa.Column[object]) -> sa.ColumnElement[object]:
    """Return a column as it is stored, so that a word or a number which labctl does not write is read too."""
    if isinstance(column.type, Instant):
        return sa.type_coerce(column, sa.BigInteger)
    return sa.type_coerce(column, sa.String) if isinstance(column.type, StateOfCampaign) else column


def _of_temperature() -> sa.ColumnElement[bool]:
    channel = _T.data_set_means.c.channel
    return channel.like("%temperature%") | channel.like("chamber%")


def _not_of_temperature() -> sa.ColumnElement[bool]:
    return sa.not_(_of_temperature())


def _ended(campaign: sa.ColumnElement[int]) -> sa.ColumnElement[bool]:
    c = _T.campaigns.c
    return campaign.in_(sa.select(c.id).where(c.state.in_(sorted(ENDED))))


def _imported_or_ended() -> sa.ColumnElement[bool]:
    r = _T.recordings.c
    return sa.or_(r.campaign_id.is_(None), _ended(r.campaign_id))


_MEANS = "number channel mean std white_std n"

RECORDING = Kind(
    "recording",
    _T.recordings,
    "id",
    (
        Part("head", _T.recordings, "id", "serial campaign_id gyro kind info channels created_at dropped"),
        Part(
            "data sets", _T.data_sets, "recording_id",
            "number position run mounting gate_from_s gate_until_s power_on_s n lost damaged turn_deg turn_u_deg "
            "planned",
            "number",
        ),
        Part("state of data sets", _T.data_sets, "recording_id", "number state reason", "number"),
        Part(
            "table rates", _T.data_sets, "recording_id", "number table_rate_dps asked_dps table_angle_deg encoder",
            "number",
        ),
        Part(
            "verification marks", _T.data_sets, "recording_id", "number verification", "number",
            lambda: _T.data_sets.c.verification, since="0018", was_empty=True,
        ),
        Part("set temperatures", _T.data_sets, "recording_id", "number chamber_setpoint_c", "number"),
        Part("means", _T.data_set_means, "recording_id", _MEANS, "number channel", _not_of_temperature),
        Part("means of temperatures", _T.data_set_means, "recording_id", _MEANS, "number channel", _of_temperature),
        Part(
            "temperatures of the environment", _T.environment, "recording_id",
            "t_s run temperature_c chamber_c chamber_setpoint_c", "id",
        ),
    ),
    lambda row: f"recording {row[0]}",
    "id",
    _imported_or_ended,
    lambda: _T.recordings.c.importing.is_(None),
    has_blocks=True,
)  # fmt: skip

CAMPAIGN = Kind(
    "campaign",
    _T.campaigns,
    "id",
    (
        Part(
            "head", _T.campaigns, "id",
            "recipe_name recipe bench_name bench schedule_hash expected_s created_at",
        ),
        Part("state", _T.campaigns, "id", "state reason started_at ended_at added_runs powered_on_s"),
        Part("plan", _T.steps, "campaign_id", "number kind body expected_s", "number"),
        Part(
            "results of steps", _T.steps, "campaign_id",
            "number state started_s ended_s started_at ended_at result", "number",
        ),
        Part(
            "events", _T.events, "campaign_id", "at t_s kind level message device value limit_value unit", "id",
        ),
        Part("recordings", _T.recordings, "campaign_id", "id serial gyro", "id"),
        Part(
            "timed runs", _T.timed_runs, "campaign_id", "session block t_s nominal_s duration_s step_hz used", "id",
            since="0023", was_empty=True,
        ),
    ),
    lambda row: f"campaign {row[0]}",
    "id",
    lambda: _ended(_T.campaigns.c.id),
)  # fmt: skip

CALIBRATION = Kind(
    "calibration",
    _T.calibrations,
    "id",
    (
        Part("head", _T.calibrations, "id", "serial version parent recording_id model created_at hash"),
        Part("document", _T.calibrations, "id", "document"),
        Part("answer", _T.calibrations, "id", "answer"),
        Part("recordings", _T.calibration_recordings, "calibration_id", "recording_id", "recording_id"),
    ),
    lambda row: f"calibration {row[0]} version {row[1]}",
    "serial version",
)

CERTIFICATION = Kind(
    "certification",
    _T.certifications,
    "id",
    (
        Part("act", _T.certifications, "id", "serial version act by reason at due_at"),
        Part(
            "verdict", _T.certifications, "id", "verdict verdict_recording verdict_at override assessment",
        ),
        Part(
            "persons", _T.certifications, "id", "by_key request_id released_by released_key release_reason",
            since="0019",
        ),
    ),
    lambda row: f"certification {row[0]} ({row[3]} of {row[1]} version {row[2]})",
    "id serial version act",
)  # fmt: skip

CERTIFICATE = Kind(
    "certificate",
    _T.certificates,
    "id",
    (
        Part("head", _T.certificates, "id", "number serial version replaces reason by at hash order"),
        Part("document", _T.certificates, "id", "document"),
        Part("XML", _T.certificates, "id", "xml"),
        Part("PDF", _T.certificates, "id", "pdf"),
        Part("persons", _T.certificates, "id", "by_key", since="0019"),
    ),
    lambda row: f"certificate {row[0]}",
    "number",
)

WITHDRAWAL = Kind(
    "withdrawal",
    _T.certificate_withdrawals,
    "id",
    (Part("head", _T.certificate_withdrawals, "id", "number by by_key reason at certification_id", since="0019"),),
    lambda row: f"withdrawal of certificate {row[0]}",
    "number",
    since="0019",
)

RELEASE_REQUEST = Kind(
    "release request",
    _T.release_requests,
    "id",
    (
        Part(
            "head", _T.release_requests, "id", "serial version by by_key reason at due_days override after_act",
            since="0019",
        ),
    ),
    lambda row: f"request {row[0]} to release {row[1]} version {row[2]}",
    "id serial version",
    since="0019",
)  # fmt: skip

KEY = Kind(
    "key",
    _T.api_keys,
    "name",
    (
        Part("role", _T.api_keys, "name", "role"),
        Part("digest", _T.api_keys, "name", "digest created_at"),
        Part("revocation", _T.api_keys, "name", "revoked_at"),
    ),
    lambda row: f"API key {row[0]!r}",
    "name",
)

STANDARD = Kind(
    "standard",
    _T.standards,
    "id",
    (Part("head", _T.standards, "id", "label serial quantity unit description by at"),),
    lambda row: f"standard {row[0]!r}",
    "label",
    since="0020",
)

STANDARD_CERTIFICATE = Kind(
    "standard certificate",
    _T.standard_certificates,
    "id",
    (
        Part(
            "certificate", _T.standard_certificates, "id",
            "standard_id number laboratory calibrated due adjusted traceability reason by at",
        ),
        Part("points", _T.standard_certificates, "id", "points"),
    ),
    lambda row: f"certificate {row[0]} of a standard",
    "number",
    since="0020",
)  # fmt: skip

STANDARD_CHECK = Kind(
    "intermediate check",
    _T.standard_checks,
    "id",
    (Part("check", _T.standard_checks, "id", "standard_id checked_at nominal value u note by at"),),
    lambda row: f"intermediate check {row[0]}",
    "id",
    since="0020",
)

STANDARD_FINDING = Kind(
    "standard finding",
    _T.standard_findings,
    "id",
    (Part("act", _T.standard_findings, "id", "standard_id act finding bad_from bad_until reason by at"),),
    lambda row: f"finding {row[0]} on a standard",
    "id",
    since="0020",
)

CHECK_GYRO = Kind(
    "check gyro",
    _T.check_gyros,
    "id",
    (Part("act", _T.check_gyros, "id", "serial act temperature_c chart_from reason by at"),),
    lambda row: f"check gyro {row[0]}",
    "serial",
    since="0020",
)

SENSOR_VERSION = Kind(
    "sensor version",
    _T.sensor_versions,
    "id",
    (
        Part("head", _T.sensor_versions, "id", "serial sensor version verdict hash by by_key at", since="0022"),
        Part("data", _T.sensor_versions, "id", "data", since="0022"),
        Part("document", _T.sensor_versions, "id", "document", since="0022"),
    ),
    lambda row: f"{row[1]} {row[0]} version {row[2]}",
    "serial sensor version",
    since="0022",
)

#: All of them.
KINDS: Mapping[str, Kind] = {
    kind.name: kind
    for kind in (
        CAMPAIGN,
        RECORDING,
        CALIBRATION,
        CERTIFICATION,
        CERTIFICATE,
        KEY,
        WITHDRAWAL,
        RELEASE_REQUEST,
        STANDARD,
        STANDARD_CERTIFICATE,
        STANDARD_CHECK,
        STANDARD_FINDING,
        CHECK_GYRO,
        SENSOR_VERSION,
    )
}
