"""Diagnoses: searches for what is missing in a model, by one experiment after the other."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata

#: State: criticising, awaiting_confirmation, measuring, done, stopped, failed.
diagnoses = sa.Table(
    "diagnoses",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),  #: that is judged in every round
    sa.Column("bench_name", sa.String(200), nullable=False),
    sa.Column("bench", sa.JSON, nullable=False),  #: bench file, as campaigns keep it
    sa.Column("hours", sa.Float, nullable=False),  #: of the bench, at most
    sa.Column("recordings", sa.JSON, nullable=False),  #: numbers of those that it began with
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("begins_at", Instant),  #: no experiment is begun before; null: at once
    sa.Column("state", sa.String(30), nullable=False),
    sa.Column("outcome", sa.String(30), nullable=False, server_default=""),  #: empty while it is not done
    sa.Column("why", sa.Text, nullable=False, server_default=""),  #: the outcome, or the stop, in a sentence
    sa.Column("ended_at", Instant),
    sa.Index(None, "serial", "id"),
    sa.Index(None, "state"),
)

#: One criticism of all recordings so far, and what was decided by it.
diagnosis_rounds = sa.Table(
    "diagnosis_rounds",
    metadata,
    sa.Column("diagnosis_id", RowId, sa.ForeignKey("diagnoses.id"), primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("recordings", sa.JSON, nullable=False),  #: numbers of those that were judged together
    sa.Column("verdict", sa.String(30), nullable=False),
    sa.Column("named", sa.JSON, nullable=False),  #: ids of effects
    sa.Column("suspects", sa.JSON, nullable=False),  #: id of effect -> probability
    sa.Column("spent_hours", sa.Float, nullable=False),  #: of the bench, before this criticism
    sa.Column("rms_dps", sa.Float),
    sa.Column("heldout_rms_dps", sa.Float),
    sa.Column("noise_floor_dps", sa.Float),
    sa.Column("experiment", sa.JSON(none_as_null=True)),  #: that was chosen; null: none
    sa.Column("why", sa.Text, nullable=False),  #: the choice, or the end, in a sentence
    sa.Column("confirmed_by", sa.String(200), nullable=False, server_default=""),
    sa.Column("since", Instant, nullable=False),  #: when the experiment was chosen, confirmed or asked for again
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id")),
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id")),
    sa.Column("took_hours", sa.Float),  #: of the bench, by the campaign of the experiment
    sa.Column("came", sa.String(20), nullable=False, server_default=""),  #: measured, cannot_be_done; empty: not over
    sa.Column("came_text", sa.Text, nullable=False, server_default=""),
)
