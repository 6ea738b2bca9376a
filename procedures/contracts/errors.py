"""The errors of procedures. The text of each is one line: what, where, value, unit, limit and what to do.

ProcedureError
├── RecipeError          a recipe cannot be read: file, key and what was expected
├── PlanRefused          a recipe asks for what the bench or a unit cannot do; all offenders at once
├── StepFailed           a step could not be carried out
│   ├── SoakFailed       a temperature was not reached or did not settle in time
│   ├── BadData          a unit's readings are missing, damaged or too few
│   ├── GuardTripped     a limit that is watched was passed
│   ├── TableStopped     the table does not move as commanded, in the middle of a data set
│   └── Unanswered       a question was not answered in time
├── Aborted              a person asked for the end
│   └── Interrupted      the bench had to be released; the campaign is to be resumed
└── StalePrompt          an answer to a question that is no longer asked
"""

from __future__ import annotations

from collections.abc import Sequence

from instruments.errors import copy_of


class ProcedureError(Exception):
    """Any failure that one line explains to a user."""

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle it whole: a subclass may take other arguments than its text."""
        return copy_of, (type(self), self.args, self.__dict__)


class RecipeError(ProcedureError):
    """A recipe cannot be read; the text names file, key and what was expected."""


class PlanRefused(ProcedureError):
    """A recipe asks for what the bench or a unit cannot do. `offenders` holds one clear text per point."""

    def __init__(self, recipe: str, offenders: Sequence[str], advice: str) -> None:
        super().__init__(f"this bench cannot run recipe {recipe}: {'; '.join(offenders)}. {advice}")
        self.offenders = tuple(offenders)


class StepFailed(ProcedureError):
    """A step could not be carried out; `figures` say how far it came."""

    def __init__(self, reason: str, figures: dict[str, float] | None = None) -> None:
        super().__init__(reason)
        self.figures = figures or {}


class SoakFailed(StepFailed):
    """A temperature was not reached, or the unit did not settle at it, in time."""


class BadData(StepFailed):
    """A unit's readings are missing, damaged or too few; `gyro` is its name."""

    def __init__(self, gyro: str, reason: str) -> None:
        super().__init__(f"{gyro}: {reason}")
        self.gyro = gyro


class NoReadings(BadData):
    """No reading of a unit arrived in a data set."""


class NotFollowing(BadData):
    """The output of a unit does not follow the rate of the table."""


class GuardTripped(StepFailed):
    """A limit that is watched was passed; `kind` names the guard and `action` what the recipe wants done."""

    def __init__(self, kind: str, action: str, reason: str, device: str = "") -> None:
        super().__init__(reason)
        self.kind = kind
        self.action = action
        self.device = device


class TableStopped(StepFailed):
    """The table does not move as commanded, in the middle of a data set."""


class Unanswered(StepFailed):
    """A question was not answered in time."""


class Aborted(ProcedureError):
    """A person asked for the end."""


class Interrupted(Aborted):
    """The bench had to be released; the campaign is to be resumed."""


class StalePrompt(ProcedureError):
    """An answer to a question that is no longer asked."""
