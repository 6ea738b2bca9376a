"""Findings as responses, and back."""

from __future__ import annotations

from labctl.answers.inspection import DataWarning, FindingJson
from labctl.recording.sanity import Finding


def warning_of(finding: Finding) -> DataWarning:
    """Return a finding as a response."""
    return DataWarning.model_validate(finding.to_json(), extra="forbid")


def finding_of(warning: DataWarning) -> Finding:
    """Return a response as the finding that it is of."""
    return Finding(
        warning.what, warning.severity, warning.where, warning.said, warning.value, warning.unit, warning.expected,
        warning.do, warning.part, warning.channel, warning.n, warning.may_leave_out,
    )  # fmt: skip


def as_json(warning: DataWarning) -> FindingJson:
    """Return a warning as it is kept with a version."""
    document = finding_of(warning).to_json()
    document["text"] = warning.text
    return document
