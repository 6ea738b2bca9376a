"""Drafts in words: for the events of a campaign, the log, the command line and the pages."""

from __future__ import annotations

from collections.abc import Iterator

from labctl.answers.drafts import DraftReport, LimitResult

LIMITS = {
    "heldout_rms_dps": "error on data left out of the fit",
    "max_error_dps": "largest error",
    "drift_dps": "drift from the version in force",
}


def report_text(serial: str, version: int, report: DraftReport) -> str:
    """Return a report as one paragraph of short sentences; the last one says what to do."""
    return " ".join(_sentences(serial, version, report))


def _sentences(serial: str, version: int, report: DraftReport) -> Iterator[str]:
    error = report.error
    left_out = error.heldout_rms_dps
    heldout = "" if left_out is None else f", on data left out of the fit {left_out:.3g} deg/s"
    error_text = "not known" if error.rms_dps is None else f"{error.rms_dps:.3g} deg/s RMS"
    yield f"Draft calibration: version {version} of {serial} ({report.model}), error {error_text}{heldout}."
    if report.verdict is not None:
        yield f"Verdict: {report.verdict}."
    if report.smallest_heldout is not None and report.smallest_heldout != report.model:
        best = report.smallest_heldout
        yield f"Of the models compared, {best} has a clearly smaller error on data left out of the fit."
    if report.as_found is not None:
        yield f"As found (version {report.as_found.version}): {report.as_found.rms_dps:.3g} deg/s RMS."
    if report.as_left is not None:
        yield f"As left (version {version}): {report.as_left.rms_dps:.3g} deg/s RMS."
    yield from _limits(report)
    yield f"It is not certified; `labctl certify {serial} {version} --by NAME --reason TEXT` puts it in force."


def _limits(report: DraftReport) -> Iterator[str]:
    broken = [limit_text(limit) for limit in report.limits if limit.passed is False]
    unknown = [LIMITS[limit.limit] for limit in report.limits if limit.passed is None]
    if broken:
        yield f"Limits of the recipe that are exceeded: {'; '.join(broken)}."
    if unknown:
        yield f"Not decided, because the figure is not known: {', '.join(unknown)}."
    if report.within_limits:
        yield "All limits are kept."


def limit_text(result: LimitResult) -> str:
    """Return a limit beside its figure."""
    axis = "" if result.axis is None else f" of axis {result.axis}"
    value = "not known" if result.value_dps is None else f"{result.value_dps:.3g} deg/s"
    return f"{LIMITS[result.limit]}{axis} {value}, limit {result.at_most_dps:.3g} deg/s"


def failure_text(serial: str, recording: int, options: str, why: str) -> str:
    """Return why a draft could not be made, and how a person makes a calibration of the same recording."""
    return (
        f"no draft of {serial}: {why.rstrip('.')}; inspect recording {recording}, then `labctl fit {serial} "
        f"--recording {recording} {options}`"
    )
