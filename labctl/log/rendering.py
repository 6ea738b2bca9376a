"""From the fields of a record to its line: JSON for programs, words in columns for a person at a terminal."""

from __future__ import annotations

import os
import traceback
from collections.abc import Mapping, MutableMapping
from typing import Any

import structlog
from structlog.typing import Processor

from labctl.log.redaction import Redaction

# What a person at a terminal reads of a log: one sentence for each change of state, warning and error.
#
# Of a record that is neither there is no line. With `LABCTL_LOG_LEVEL` set every record is written, as columns.

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


Fields = MutableMapping[str, Any]
#: In this order at the beginning of a line.
FIRST = ("timestamp", "level", "event", "process")
#: What a terminal could obey: control characters, and those that turn the direction of a text.
_CONTROLS = {
    code: f"\\x{code:02x}"
    for code in (*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A))
}


class Rendering:
    """The last of structlog's processors, for labctl's own records and those of other libraries.

    Where `brief`, a person gets sentences, and structlog.DropEvent is raised for a record that has none; else it raises
    nothing.
    """

    def __init__(
        self, process: str, redaction: Redaction, *, for_a_person: bool, brief: bool = False, colors: bool = False
    ) -> None:
        self._process = {"process": process, "pid": os.getpid()}
        self._redaction = redaction
        self._for_a_person, self._brief = for_a_person, for_a_person and brief
        self._time = structlog.processors.TimeStamper(fmt="iso", utc=not for_a_person)
        self._last: Processor = structlog.processors.JSONRenderer()
        if for_a_person:
            self._last = structlog.dev.ConsoleRenderer(
                colors=colors, exception_formatter=structlog.dev.plain_traceback, pad_event_to=20, sort_keys=False
            )

    def __call__(self, logger: Any, method: str, fields: Fields) -> str:
        """Return the line of a record."""
        try:
            return self._line(logger, method, fields)
        except structlog.DropEvent:
            raise
        except Exception as error:  # noqa: BLE001  a record that cannot be written must stop no caller
            text = f"{type(error).__name__} in a record of {fields.get('event')!r:.100}"
            return str(self._last(logger, "error", {"event": "log.unreadable", "level": "error", "error": text}))

    def _line(self, logger: Any, method: str, fields: Fields) -> str:
        chain = (
            structlog.contextvars.merge_contextvars, structlog.processors.add_log_level, self._time,
            structlog.processors.format_exc_info,
        )  # fmt: skip
        line: Any = {**self._process, **fields}
        for each in chain:
            line = each(logger, method, line)
        if line["level"] == "warn":
            line["level"] = "warning"
        clean = self._redaction.fields(line)
        ordered = {name: clean.pop(name) for name in FIRST if name in clean} | clean
        if not self._for_a_person:
            return str(self._last(logger, method, ordered))
        shown_fields = self._shown(ordered)
        text = sentence(shown_fields) if self._brief else None
        if text == "":
            raise structlog.DropEvent
        return str(self._last(logger, method, shown_fields)) if text is None else f"{shown_fields['timestamp']} {text}"

    def _shown(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the fields for a terminal: the time of day alone, and nothing that it obeys."""
        shown_fields = {
            name: value.translate(_CONTROLS) if isinstance(value, str) and name != "exception" else value
            for name, value in fields.items()
        }
        return {**shown_fields, "timestamp": str(shown_fields["timestamp"])[11:19]}


def error_fields(error: BaseException) -> dict[str, Any]:
    """Return what a record says of an error that is expected, without its traceback."""
    return {"error": str(error) or type(error).__name__, "error_type": type(error).__name__}


def traceback_of(error: BaseException) -> str:
    """Return the traceback of an error as text."""
    return "".join(traceback.format_exception(error))
