"""What was found out about an instrument: good, doubtful, or bad, and then with what to do."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

from instruments.errors import InstrumentError

#: `doubtful`: a campaign can run, and its figures may be worse; `bad`: it cannot, or its figures would be wrong.
State = Literal["good", "doubtful", "bad"]
Kind = Literal["table", "chamber", "reference", "supply", "gyro", "other"]
STATES: tuple[State, ...] = ("good", "doubtful", "bad")


@dataclass(frozen=True)
class Finding:
    """One thing that was found out. The text of one that is not good says what to do."""

    what: str  #: noun: air temperature, clock, port ...
    text: str
    state: State = "good"
    value: float | None = None
    unit: str = ""


@dataclass
class DeviceReport:
    """Everything that was found out about one instrument."""

    device: str  #: "table", "chamber", "supply" or gyro name
    kind: Kind
    address: str
    findings: list[Finding] = field(default_factory=list)
    reported: dict[str, str] = field(default_factory=dict)  #: what it and its USB adapter say of themselves

    @property
    def state(self) -> State:
        """The worst state of a finding."""
        states = {finding.state for finding in self.findings}
        worst: State = "good"
        for state in STATES:
            worst = state if state in states else worst
        return worst

    @property
    def is_ok(self) -> bool:
        """Whether nothing bad was found."""
        return self.state != "bad"

    @property
    def text(self) -> str:
        """What is bad or, where nothing is, everything in one line."""
        bad = [finding.text for finding in self.findings if finding.state == "bad"]
        return "; ".join(bad or [finding.text for finding in self.findings])

    def add(self, findings: Iterable[Finding]) -> None:
        """Add findings."""
        self.findings.extend(findings)

    def failed(self, what: str, error: InstrumentError) -> None:
        """Add that an instrument did not answer, or not as it should."""
        self.findings.append(Finding(what, str(error).removeprefix(f"{error.device}: "), "bad"))
