"""What is stored of the judgement of a version: objections, verdict, and where its due date is from."""

from __future__ import annotations

from typing import Literal

from typing_extensions import TypedDict

DueSource = Literal["user", "recipe", "configuration"]


class Objection(TypedDict):
    """One objection to certifying a version."""

    what: Literal["verdict", "worse", "data", "standard"]
    """verdict: the model lacks something, or there is no verdict; worse: an error without compensation or of another
    version is smaller; data: the data are certainly wrong; standard: a reference standard was bad."""
    text: str
    """The objection, with figures in deg/s."""
    do: str
    """What to do instead of certifying the version."""


class JudgementDetail(TypedDict, total=False):
    """What is stored beside a verdict."""

    verdict_reason: str
    """Why there is no verdict; empty if there is one."""
    verdict_text: str
    """The verdict in words; empty if there is none."""
    cause_not_known: list[str]
    """What the verdict does not show, in sentences: which of several effects is the cause."""
    error: dict[str, float | None]
    """Name -> RMS error that the version states, deg/s; null: unknown."""
    objections: list[Objection]
    """Objections that were overridden; empty: none."""
    due_from: str | None
    """Where the due date is from; null: no due date."""
    uncertainty_unknown: str
    """Why the uncertainty in use was unknown; empty: it was known."""
