"""Findings as responses, and back."""

from __future__ import annotations

from dataclasses import asdict

from labctl.answers.inspection import DataWarning
from labctl.answers.json_object import JsonObject
from labctl.recording.sanity import Finding

#: Fields of a warning about single readings; one about anything else is kept without them.
_OF_READINGS = {"channel", "n", "may_leave_out"}


def warning_of(finding: Finding) -> DataWarning:
    """Return a finding as a response."""
    return DataWarning.model_validate({**asdict(finding), "text": finding.text}, extra="forbid")


def finding_of(warning: DataWarning) -> Finding:
    """Return a response as the finding that it is of."""
    return Finding(
        warning.what, warning.severity, warning.where, warning.said, warning.value, warning.unit, warning.expected,
        warning.do, warning.part, warning.channel, warning.n, warning.may_leave_out,
    )  # fmt: skip


def as_json(warning: DataWarning) -> JsonObject:
    """Return a warning as it is kept with a version."""
    return warning.model_dump(mode="json", exclude=_OF_READINGS if warning.n is None else None)
