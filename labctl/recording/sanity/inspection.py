"""All checks of a recording, in order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from labctl.recording.columns import VERIFICATION
from labctl.recording.info import RecordingInfo
from labctl.recording.recording import Columns, Recording
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.gain import check_responses
from labctl.recording.sanity.gross_rates import check_ratios
from labctl.recording.sanity.outlying import check_outlying
from labctl.recording.sanity.readings import examine
from labctl.recording.sanity.response import responses
from labctl.recording.sanity.summary import Summary, summarise
from labctl.recording.sanity.table_rate_ratio import check_reference
from labctl.recording.sanity.time_stamps import check_time
from labctl.recording.sanity.turned import check_turned, off_turns
from labctl.recording.sanity.within import check_at_rest, check_changes, check_codes, check_spread, with_two_rates
from labctl.recording.unread import TAKE_AGAIN


def check_damage(info: RecordingInfo) -> Iterator[Finding]:
    """Yield what was lost where the file was damaged or cut off."""
    if info.unread:
        percent = None if info.unread_share is None else 100 * info.unread_share
        yield Finding("unread", "likely", "file", info.unread, percent, "%", "a file that is whole", TAKE_AGAIN)


#: Findings of the gain of an axis: what single data sets of it say follows from them.
OF_AXIS = frozenset({"sign", "scale", "unit", "no_response", "crossed", "one_data_set"})


def inspect_recording(recording: Recording) -> list[Finding]:
    """Return the findings of a whole recording, the certain ones first; none for a table of coefficients."""
    return findings_of(summarise(recording), recording.environment, [each.finding for each in examine(recording)])


def findings_of(
    summary: Summary, environment: Columns | None = None, of_readings: Sequence[Finding] = ()
) -> list[Finding]:
    """Return the findings of a summary, and those of single readings, the certain ones first.

    What is fitted and what was measured to verify a calibration are examined apart: neither hides a fault of the other,
    and each finding names its part.
    """
    if len(summary) == 0:
        return sorted(of_readings, key=_order)
    aside = np.asarray(summary[VERIFICATION], dtype=np.bool_)
    findings = list(check_damage(summary.info))
    if not aside.all():
        findings += _findings(summary.take(~aside), environment)
    if aside.any():
        of_part = _findings(summary.take(aside), None)
        findings += [replace(each, part="verification", where=f"verification part, {each.where}") for each in of_part]
    return sorted([*findings, *_not_said(of_readings, findings)], key=_order)


def _not_said(of_readings: Sequence[Finding], findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield findings of readings but those that the data sets' figures say too, with what they leave in the means."""
    stated_findings = {(finding.what, finding.channel) for finding in findings if finding.channel}
    yield from (finding for finding in of_readings if (finding.what, finding.channel) not in stated_findings)


def _with_gross(findings: Sequence[Finding], gross: Sequence[Finding]) -> list[Finding]:
    """Return findings of rates and the gross ones: what wraps explains all else of its axis; none is said twice."""
    wrapped = {each.where.partition(",")[0] for each in gross if each.what == "wrapped"}
    places = {finding.where for finding in findings} | {
        "of a whole axis" for finding in findings if finding.what in OF_AXIS
    }
    added = [each for each in gross if each.what == "wrapped" or not {each.where, "of a whole axis"} & places]
    return [*(finding for finding in findings if not wrapped & set(finding.where.split(", "))), *added]


def _order(finding: Finding) -> bool:
    return finding.severity != "certain"


def _findings(summary: Summary, environment: Columns | None) -> list[Finding]:
    if summary.info.motion == "poses":  # no rate is known that an output could follow
        return list(check_time(summary, environment))
    if summary.info.motion == "profile":  # a rate may change, and so may the output
        return [*check_responses(summary, responses(summary)), *check_time(summary, environment)]
    off = off_turns(summary)
    sound = np.ones(len(summary), dtype=bool)
    sound[[turn.row for turn in off]] = False
    trusted = summary.take(sound) if off else summary
    whole = summary.take(~np.any([with_two_rates(summary, axis) for axis in summary.info.axes], axis=0))
    of_rates = [
        *check_responses(trusted, responses(trusted)),
        *(check_outlying(whole, responses(whole)) if summary.info.motion != "turns" else ()),
    ]
    return [
        *check_turned(summary, off),
        *_with_gross(of_rates, list(check_ratios(whole))),
        *check_changes(summary),
        *check_at_rest(summary),
        *check_spread(summary),
        *check_codes(summary),
        *check_time(summary, environment),
        *check_reference(summary),
    ]
