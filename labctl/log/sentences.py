"""What a person at a terminal reads of a log: one sentence for each change of state, warning and error.

Of a record that is neither there is no line. With `LABCTL_LOG_LEVEL` set every record is written, as columns.
"""

from __future__ import annotations

from collections.abc import Mapping

#: Changes of state: event -> sentence over the fields of its record.
CHANGES: Mapping[str, str] = {
    "campaign.planned": "campaign {campaign} on {bench}: planned, recipe {recipe}, {datasets} data sets",
    "campaign.resumed": "campaign {campaign} on {bench}: resumed at step {step}: {reason}",
    "campaign.state": "campaign {campaign} on {bench}: {state}: {reason}",
    "campaign.closed": "campaign {campaign} on {bench}: ended without a process: {reason}",
    "campaign.asked": "campaign {campaign}: {by} requests {act}: {reason}",
    "campaign.stop": "campaign {campaign} on {bench}: stopping: {reason}",
    "schedule.started": "scheduled start {start} on {bench}: campaign {campaign} begins",
    "schedule.missed": "scheduled start {start} on {bench} of recipe {recipe}: {reason}",
    "schedule.refused": "scheduled start {start} on {bench} of recipe {recipe} was refused: {reason}",
    "schedule.trouble": "the schedule of bench {bench} cannot be carried out, and labctl tries again: {error}",
    "schedule.well": "the schedule of bench {bench} is carried out again",
    "bench.made_safe": "bench {bench} is in its safe state",
    "bench_process.silent": "the bench process has not answered for {silent_s} s; the bench may move: inspect the "
    "bench",
    "bench_process.heard": "the bench process answers again",
    "child.silent": "the {child} process has not answered for {silent_s} s; labctl starts that process again",
    "child.ended": "the {child} process ended; labctl starts it again",
    "child.restarted": "the {child} process was started again",
}
#: Sentences of records that are warnings or errors.
TROUBLE: Mapping[str, str] = {
    "bench.made_safe": "bench {bench} is not confirmed safe: {unconfirmed}; inspect it",
    "safe_state.retried": "bench {bench} is still not confirmed safe: {unconfirmed}; inspect it",
    "clock.slow": "campaign {campaign} on {bench}: simulated time runs at {reached:g} times real time; {asked:g} was "
    "asked for, which this computer does not reach now",
    "campaign.event": "campaign {campaign} on {bench}: {message}",
    "step.ended": "campaign {campaign} on {bench}: step {step} of {steps} ({kind}) {outcome}: {reason}",
    "dataset.closed": "campaign {campaign} on {bench}: data set {dataset} {state}: {reason}",
    "unit.dropped": "campaign {campaign} on {bench}: unit {unit} is excluded from the rest of the campaign: {reason}",
    "live.kept": "{text}",
    "request.ended": "{method} {path} failed with status {status}; X-Request-ID {request_id} names it in the log",
}
SERIOUS = frozenset({"warning", "error", "critical"})


def sentence(fields: Mapping[str, object]) -> str | None:
    """Return the sentence of a record; empty where it is not to be shown, None where only its fields tell it."""
    event, level = str(fields["event"]), str(fields["level"])
    serious = level in SERIOUS
    template = (TROUBLE.get(event) if serious else None) or CHANGES.get(event)
    if template is None or "exception" in fields:
        return None if serious else ""
    try:
        text = template.format_map({name: _words(value) for name, value in fields.items()})
    except KeyError:  # a record without one of the fields
        return None if serious else ""
    return f"{level}: {text}" if serious else text


def _words(value: object) -> object:
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else value
