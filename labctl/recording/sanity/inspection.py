"""All checks of a recording, in order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.recording.columns import VERIFICATION
from labctl.recording.info import RecordingInfo
from labctl.recording.positions import Position
from labctl.recording.recording import Columns, Recording
from labctl.recording.sanity.finding import Finding, numbers_in_words
from labctl.recording.sanity.gain import check_responses
from labctl.recording.sanity.outlying import check_outlying
from labctl.recording.sanity.readings import examine
from labctl.recording.sanity.response import responses
from labctl.recording.sanity.summary import Summary, summarise
from labctl.recording.sanity.turned import check_turned, off_turns
from labctl.recording.sanity.within import check_at_rest, check_changes, check_codes, check_spread, with_two_rates
from labctl.recording.unread import TAKE_AGAIN

#: Units that time stamps come in, and how many of them are a second.
UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}
#: A ratio within this share of a unit's is that unit.
NEAR_UNIT = 0.25
#: A table angle tells the unit of time from this rate on, deg/s; the angle may be off by this share.
TELLING_DPS, ANGLE_SETS = 1.0, 3
#: Readings this far apart, s, or recordings that last so long, are not in seconds.
SLOW_STEP_S, LONG_S = 60.0, 1e7
#: Whole numbers are what a counter of ms or us has: of them readings are in question that are this far apart, s.
WHOLE_STEP_S = 5.0
#: Readings within a data set that slow are no data set of a minute.
MIN_READINGS = 16
#: Time stamps that begin later than this after `started_at`, s, count from somewhere else.
LATE_S = 1e8


def check_time(summary: Summary, environment: Columns | None = None) -> Iterator[Finding]:
    """Yield what is wrong with the time stamps."""
    begin = np.asarray(summary["t_begin_s"], dtype=np.float64)
    if not np.isfinite(begin).all() or not len(begin):
        return
    yield from _unit(summary, environment)
    yield from _origin(summary, float(begin[0]))


def _unit(summary: Summary, environment: Columns | None) -> Iterator[Finding]:
    step = np.asarray(summary["step_s"], dtype=np.float64)
    usual = float(np.nanmedian(step)) if np.isfinite(step).any() else np.nan
    for evidence, ratio in (
        (
            f"successive time stamps differ by {usual:.4g}, but sample_rate_hz = {summary.info.sample_rate_hz or 0:g}",
            _by_rate(summary, usual),
        ),
        ("the rate of change of the table angle differs from the table's rate", _by_angle(summary)),
        ("the times of the environment end at another value", _by_environment(summary, environment)),
    ):
        unit = next((name for name, per_s in UNITS.items() if abs(np.log(max(ratio, 1e-12) / per_s)) < NEAR_UNIT), None)
        if unit is not None:
            text = f"the time stamps are in {unit}: {evidence}"
            do = f"divide column t_s by {UNITS[unit]:g}"
            yield Finding("time_unit", "certain", "column t_s", text, ratio, "per s", "seconds", do)
            return
    span = float(summary["t_end_s"][-1] - summary["t_begin_s"][0])
    slow = (
        summary.info.sample_rate_hz is None and usual > (WHOLE_STEP_S if _whole(summary) else SLOW_STEP_S)
        and float(np.median(np.asarray(summary["n"], dtype=np.float64))) >= MIN_READINGS
    )  # fmt: skip
    if slow or span > LONG_S:
        text = (
            f"a reading every {usual:.4g} s" if slow else f"the recording lasts {span:.3g} s ({span / 86400:.0f} days)"
        )
        do = "if the time stamps are in ms or us, divide column t_s by 1e3 or 1e6; if not, give sample_rate_hz"
        value = usual if slow else span
        yield Finding("time_unit", "likely", "column t_s", text, value, "s", "seconds", do)


def _whole(summary: Summary) -> bool:
    """Whether the data sets begin and end at whole numbers, with whole steps between."""
    ends = np.concatenate([np.asarray(summary[name], dtype=np.float64) for name in ("t_begin_s", "t_end_s", "step_s")])
    ends = ends[np.isfinite(ends)]
    return bool(np.all(ends == np.round(ends)))


def _by_rate(summary: Summary, usual: float) -> float:
    rate_hz = summary.info.sample_rate_hz
    return usual * rate_hz if rate_hz and np.isfinite(usual) else 1.0


def _by_angle(summary: Summary) -> float:
    """Return how many units of time are a second by the table's angle; 1 where it does not say."""
    rate, turning = (np.asarray(summary[name], dtype=np.float64) for name in ("table_rate_dps", "turning_dps"))
    telling = np.isfinite(turning) & (np.abs(rate) > TELLING_DPS) & (turning != 0)
    return float(np.median(rate[telling] / turning[telling])) if telling.sum() >= ANGLE_SETS else 1.0


def _by_environment(summary: Summary, environment: Columns | None) -> float:
    """Return the end of the data sets over that of the environment; 1 without an environment."""
    if environment is None or "t_s" not in environment or len(environment["t_s"]) < 2:
        return 1.0
    theirs = np.asarray(environment["t_s"], dtype=np.float64)
    span = float(np.ptp(theirs))
    return float(summary["t_end_s"][-1] - summary["t_begin_s"][0]) / span if span > 0 else 1.0


def _origin(summary: Summary, first_s: float) -> Iterator[Finding]:
    if abs(first_s) <= LATE_S:
        return
    text = (
        f"the first reading is at {first_s:.6g} s: the time stamps count from another instant, such as 1970, not "
        "from started_at"
    )
    begun = summary.info.measured_at
    instant = f"the instant of started_at ({begun:%Y-%m-%d %H:%M} UTC)" if begun else "the time of the first reading"
    do = f"subtract {instant} from column t_s"
    yield Finding("time_origin", "likely", "column t_s", text, first_s, "s", "seconds since started_at", do)


# Gross faults of the rates of data sets, where few sets tell: an output that wraps round, a rate ten times too small.
#
# The statistics of `outlying` need many data sets in a position; what is off by 30 % and more is seen with three that
# agree.

Array = NDArray[np.float64]
#: A rate below this share of the fastest is taken as that share; data sets that must agree, and their share.
MIN_SHARE, MIN_AGREEING, AGREEING_SHARE = 0.1, 3, 0.5
#: An output disagrees that is off by this share of the rate; the jumps of one that wraps differ by at most this share.
OFF_SHARE, SAME_JUMP = 0.3, 0.03


def check_ratios(summary: Summary) -> Iterator[Finding]:
    """Yield the outputs that wrap round at the end of their range, and data sets whose rate is grossly wrong."""
    if summary.info.motion != "rates":
        return
    places = np.asarray(summary["position"]).astype(str)
    for position in dict.fromkeys(places.tolist()):
        along = Position.of(position)
        if along.axis in summary.info.axes:
            yield from _of_position(summary.take(places == position), along)


def _of_position(sets: Summary, along: Position) -> Iterator[Finding]:
    rate = along.sign * np.asarray(sets["table_rate_dps"], dtype=np.float64)
    output = np.asarray(sets.of_axis("mean", along.axis), dtype=np.float64)
    fast = float(np.abs(rate).max(initial=0.0))
    if fast < MIN_DPS or not np.isfinite(output).all():
        return
    numbers = np.asarray(sets["dataset"], dtype=np.float64)
    slow = np.abs(rate) <= MIN_SHARE * fast
    if slow.any() and (wrapped := _wrapped(along, numbers, rate, output, float(np.median((output - rate)[slow])))):
        yield wrapped
        return
    apart = rate - (output - float(np.median(output - rate)))
    is_off = np.abs(apart) > OFF_SHARE * np.maximum(np.abs(rate), MIN_SHARE * fast)
    agreeing = int((~is_off).sum())
    if not is_off.any() or agreeing < MIN_AGREEING or agreeing < AGREEING_SHARE * len(is_off):
        return
    for row in np.flatnonzero(is_off):
        stated_dps, shown_dps = float(rate[row]), float(rate[row] - apart[row])
        yield Finding(
            "one_data_set", "likely", f"data set {int(numbers[row])}, axis {along.axis}",
            f"the rate is given as {along.sign * stated_dps:.6g} deg/s, but the output shows "
            f"{along.sign * shown_dps:.4g} "
            f"deg/s, where {agreeing} other data sets agree with their rate",
            along.sign * shown_dps, "deg/s", f"{along.sign * stated_dps:.6g} deg/s",
            "correct the rate, its sign or the number of the data set, or leave the data set out",
        )  # fmt: skip


def _wrapped(along: Position, numbers: Array, rate: Array, output: Array, bias_dps: float) -> Finding | None:
    """Return that an output wraps round, if the (m,) data sets that are off all jump by one range; else None.

    `bias_dps` is that of the slow data sets: of the fast ones most may be wrapped.
    """
    apart = rate - (output - bias_dps)
    is_off = np.abs(apart) > OFF_SHARE * np.maximum(np.abs(rate), MIN_SHARE * float(np.abs(rate).max()))
    if is_off.sum() < 2 or (~is_off).sum() < MIN_AGREEING:
        return None
    jump = float(np.median(np.abs(apart[is_off])))
    top = float(np.abs(output).max())
    one_jump = bool(np.all(np.abs(np.abs(apart[is_off]) / jump - 1) < SAME_JUMP))
    outward = bool(np.all(np.sign(apart[is_off]) == np.sign(rate[is_off])))
    if not (one_jump and outward and jump / 2 > (1 - SAME_JUMP) * top):
        return None
    return Finding(
        "wrapped", "certain", f"axis {along.axis}, {numbers_in_words(numbers[is_off])}",
        f"the output is {jump:.6g} deg/s from the rate, always towards the other end of its range, and never "
        f"beyond {top:.6g} deg/s: its number wraps round there",
        jump, "deg/s", "an output that follows the rate",
        "leave these data sets out, or give the words as unsigned or wider ones (signed_bits of the column map)",
    )  # fmt: skip


#: Slower data sets say nothing of a ratio, deg/s.
MIN_DPS = 1.0
#: Data sets of one direction that are compared, at least, where no uncertainty of the angle's rate is known.
MIN_SETS = 3
#: What counts as no error, ppm; beyond the largest it is no ratio but another unit or a wrapped angle.
NO_PPM, LARGEST_PPM = 20.0, 1e4
COVERAGE = 3.0


def check_reference(summary: Summary) -> list[Finding]:
    """Return a finding where the logged angle of the table turns by another rate than its rate column says.

    Two rates of one table differ by table_rate_ratio, whatever the gyro does. Each direction is judged by itself.
    """
    if summary.info.motion != "rates":
        return []
    rate, turning, u = (
        np.asarray(summary[name], dtype=np.float64) for name in ("table_rate_dps", "turning_dps", "turning_u_dps")
    )
    usable = np.isfinite(turning) & (np.abs(rate) >= MIN_DPS)
    ways = {"forwards": usable & (rate > 0), "backwards": usable & (rate < 0)}
    deviations = {
        way: 1e6 * np.array(_deviation(rate[of_way], turning[of_way], u[of_way]))
        for way, of_way in ways.items()
        if np.count_nonzero(of_way) >= (MIN_SETS if np.isnan(u[of_way]).any() else 1)
    }
    off = [way for way, (ppm, u_ppm) in deviations.items() if max(NO_PPM, COVERAGE * u_ppm) < abs(ppm)]
    if not off or max(abs(ppm) for ppm, _ in deviations.values()) > LARGEST_PPM:
        return []
    each = ", ".join(f"{ppm:+.0f} ppm {way} (u {u_ppm:.0f} ppm)" for way, (ppm, u_ppm) in deviations.items())
    worst_ppm = max((float(deviations[way][0]) for way in off), key=abs)
    return [
        Finding(
            "table_rate_ratio", "likely", "column table_rate_dps",
            f"table_rate_ratio: the logged table angle shows a rate that is larger than the commanded rate by "
            f"{each}", worst_ppm, "ppm",
            f"the same rate within {NO_PPM:g} ppm or {COVERAGE:g} u",
            "make the rate of the angle the reference (reference = \"measured\" in the bench file): the output of a "
            "gyro does not tell this from its scale factor, which contains it",
        )
    ]  # fmt: skip


def _deviation(rate: NDArray[np.float64], turning: NDArray[np.float64], u: NDArray[np.float64]) -> tuple[float, float]:
    """Return the ratio of two rates (m,) less 1, and its standard uncertainty: the scatter, or what is known of it."""
    weight = rate**2
    off = float(np.sum(rate * (turning - rate)) / np.sum(weight))
    residual = turning - (1 + off) * rate
    scatter = float(np.sqrt(residual @ residual / (len(rate) - 1) / weight.sum())) if len(rate) >= MIN_SETS else 0.0
    u_mean = float(np.sqrt(np.sum((rate * np.nan_to_num(u)) ** 2)) / np.sum(weight))
    return off, max(scatter, u_mean)


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
