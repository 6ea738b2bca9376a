"""Every table, with the metadata that they are all in; each is declared in the module of its noun."""

from __future__ import annotations

from labctl.store.schema.audit import audit, audit_head
from labctl.store.schema.benches import benches, leases, room_environment
from labctl.store.schema.calibrations import (
    calibration_fetches,
    calibration_recordings,
    calibrations,
    certifications,
    release_requests,
)
from labctl.store.schema.campaigns import campaigns, events, steps, timed_runs
from labctl.store.schema.certificates import certificate_withdrawals, certificates
from labctl.store.schema.diagnoses import diagnoses, diagnosis_rounds
from labctl.store.schema.drafts import drafts
from labctl.store.schema.fleet import fleet_coefficients, fleet_evidence, fleet_jobs, fleet_units
from labctl.store.schema.keys import api_keys
from labctl.store.schema.manifests import block_digests, manifest_head, manifests
from labctl.store.schema.recordings import data_set_means, data_sets, environment, recordings, sample_blocks
from labctl.store.schema.schedule import scheduled_starts, start_events
from labctl.store.schema.sensors import sensor_versions
from labctl.store.schema.standards import (
    check_gyros,
    standard_certificates,
    standard_checks,
    standard_findings,
    standards,
)
from labctl.store.schema.types import Instant, metadata
from labctl.store.schema.units import units

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
    "diagnoses",
    "diagnosis_rounds",
    "drafts",
    "environment",
    "events",
    "fleet_coefficients",
    "fleet_evidence",
    "fleet_jobs",
    "fleet_units",
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
