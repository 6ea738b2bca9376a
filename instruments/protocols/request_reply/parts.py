"""Parts of a description that chambers, tables and thermometers share: the line, questions, states, commands."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints, field_validator, model_validator

from instruments.bench_config import Strict
from instruments.protocols.request_reply.templates import require_template
from instruments.protocols.text_lines.line_syntax import LineSyntax

FORMAT = "labctl-lines/1"
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
VALUE, TEXT = rf"\s*(?P<value>{NUMBER})\s*", r"(?P<text>.*\S.*)"
Title = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=80)]


def require_pattern(pattern: str, *groups: str) -> str:
    """Return a regular expression that has the groups; raises ValueError."""
    try:
        named_groups = re.compile(pattern).groupindex
    except re.error as error:
        raise ValueError(f"pattern {pattern!r} is not a regular expression ({error}); correct it") from None
    for group in groups:
        if group not in named_groups:
            raise ValueError(f"pattern {pattern!r} has no group (?P<{group}>...); put it around the {group}")
    return pattern


def _pattern(pattern: str) -> str:
    return require_pattern(pattern)


def _listed(value: object) -> object:
    return [value] if isinstance(value, str) else value


Pattern = Annotated[str, StringConstraints(max_length=500), BeforeValidator(lambda given: _pattern(str(given)))]
Commands = Annotated[tuple[str, ...], BeforeValidator(_listed)]


class Ask(Strict):
    """A request and where its reply holds the answer: in a group of a pattern, or in a field of a separated list."""

    send: str
    reply: str | None = None  #: pattern of the whole reply, with the group `value` or `text`
    field: int | None = Field(default=None, ge=0, le=63)  #: counted from 0
    separator: str = Field(default=",", min_length=1, max_length=3)

    @model_validator(mode="after")
    def _one_way(self) -> Ask:
        if self.reply is not None and self.field is not None:
            raise ValueError(f"request {self.send!r} has both reply and field; keep one of the two")
        if self.reply is not None:
            require_pattern(self.reply, self._group)
        return self

    @property
    def _group(self) -> str:
        return "text"

    @property
    def pattern(self) -> str:
        """Pattern of the whole reply."""
        if self.reply is not None:
            return self.reply
        if self.field is None:
            return VALUE if self._group == "value" else TEXT
        mark = re.escape(self.separator)
        # a reply with fewer fields is no reply; the one that counts is stripped
        before = rf"(?:(?!{mark}).)*{mark}" * self.field
        one = NUMBER if self._group == "value" else rf"(?:(?!{mark}).)*?"
        return rf"{before}\s*(?P<{self._group}>{one})\s*(?:{mark}.*)?"


class AskText(Ask):
    """A question that is answered by a text, in the group `text`."""


class AskNumber(Ask):
    """A question that is answered by a number, in the group `value`."""

    @property
    def _group(self) -> str:
        return "value"


class AskState(Ask):
    """A question that is answered by yes or no: by two patterns, by the bits of a number, or by a number near 0.

    A text that fits neither pattern is no answer.
    """

    yes: Pattern | None = None
    no: Pattern | None = None
    any_set: int | None = Field(default=None, gt=0)  #: yes where one of these bits is set
    none_set: int | None = Field(default=None, gt=0)  #: yes where none of these bits is set
    below: float | None = Field(default=None, gt=0)  #: yes where the number, without its sign, is below this

    @model_validator(mode="after")
    def _one_rule(self) -> AskState:
        rules = [self.yes is not None or self.no is not None]
        rules += [each is not None for each in (self.any_set, self.none_set, self.below)]
        if sum(rules) != 1 or (self.yes is None) != (self.no is None):
            raise ValueError(
                f"request {self.send!r}: give one rule for its answer: both yes and no (patterns), or any_set, or "
                "none_set (bits), or below (a number)"
            )
        return self

    @property
    def _group(self) -> str:
        return "text" if self.yes is not None else "value"

    def holds(self, answer: str) -> bool | None:
        """Return whether an answer means yes; None where it means neither. Yes and no together is no."""
        if self.yes is not None and self.no is not None:
            if re.fullmatch(self.no, answer):
                return False
            return True if re.fullmatch(self.yes, answer) else None
        try:
            number = float(answer)
        except ValueError:
            return None
        if self.below is not None:
            return abs(number) < self.below
        if not number.is_integer() or number < 0:
            return None
        return bool(int(number) & self.any_set) if self.any_set else not int(number) & (self.none_set or 0)


class AskAlarms(Ask):
    """A question about alarms: a text that means none, else the alarms by their bits or as the text."""

    none: Pattern
    bits: dict[Annotated[str, StringConstraints(pattern=r"^\d{1,9}$")], str] = Field(default_factory=dict)

    def alarms(self, answer: str) -> tuple[str, ...]:
        """Return the alarms that an answer names."""
        if re.fullmatch(self.none, answer):
            return ()
        if self.bits and answer.strip().isdigit():
            number = int(answer)
            named = tuple(text for bit, text in self.bits.items() if number & int(bit))
            return named or (f"alarm {number}",)
        return (f"alarm {answer}",)


class Check(AskText):
    """What is asked after each command: whether it was an error."""

    passes: Pattern  #: the answer that means no error


class LineDescription(Strict):
    """The line: how a request ends, how a refusal reads, and the times."""

    baudrate: int = Field(default=9600, gt=0, le=4_000_000)
    tcp_port: int | None = Field(default=None, gt=0, le=65535)
    end: Literal["\r", "\n", "\r\n", ""] = "\r\n"  #: of a request; a reply may end with either
    reply_end: str = Field(default="", max_length=20)  #: a text that ends a reply, in place of a line end
    encoding: Literal["ascii", "latin-1", "utf-8"] = "ascii"
    timeout_s: float = Field(default=1.0, ge=0.05, le=30)  #: of a reply
    pause_s: float = Field(default=0.0, ge=0, le=10)  #: least time between two requests
    poll_s: float = Field(default=0.2, ge=0.02, le=10)  #: between two questions while something is awaited
    refusal: str = ""  #: pattern of a reply that refuses, with the group `why`
    reasons: dict[str, str] = Field(default_factory=dict)  #: what a reason means
    acknowledged: Pattern | None = None  #: pattern of the reply to a command; none: a command has no reply
    slow: Commands = ()  #: commands that are answered when what they do is done
    slow_s: float = Field(default=120.0, gt=0, le=3600)  #: longest time of these
    may_refuse: Commands = ()  #: commands whose refusal is no error: the instrument is as they would make it
    check: Check | None = None

    @field_validator("refusal")
    @classmethod
    def _says_why(cls, pattern: str) -> str:
        return require_pattern(pattern, "why") if pattern else pattern

    @property
    def syntax(self) -> LineSyntax:
        """The syntax of its link."""
        return LineSyntax(
            self.end, self.reply_end, self.encoding, self.refusal, tuple(self.reasons.items()), self.pause_s
        )


class Description(Strict):
    """What every described instrument has."""

    format: Literal["labctl-lines/1"]
    name: Title
    source: str = ""  #: which manual the lines are from
    line: LineDescription = Field(default_factory=LineDescription)
    parameters: dict[str, str | int | float] = Field(default_factory=dict)  #: in braces; the bench file may differ

    @field_validator("parameters")
    @classmethod
    def _are_texts(cls, texts: dict[str, str | int | float]) -> dict[str, str | int | float]:
        for name, value in texts.items():
            if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or not str(value).isprintable() or not str(value):
                raise ValueError(f"parameter {name} = {value!r} is not a printable text under a name; correct it")
        return texts

    def require_requests(self, numbers: dict[str, Iterable[str]]) -> None:
        """Raise ValueError, with its place, for a request with an unknown value. key -> names of its numbers."""
        for key in type(self).model_fields:
            request = getattr(self, key)
            lines = request if isinstance(request, tuple) else (request.send,) if isinstance(request, Ask) else ()
            for line in lines:
                try:
                    require_template(line, numbers.get(key, ()), self.parameters)
                except ValueError as error:
                    raise ValueError(f"{key}: {error}") from None
        if self.line.check is not None:
            require_template(self.line.check.send, (), self.parameters)
