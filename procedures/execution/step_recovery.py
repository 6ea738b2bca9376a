"""Which failures of a step the recipe allows to recover from, and how often."""

from __future__ import annotations

from dataclasses import dataclass

from instruments.errors import LinkError
from procedures.contracts.errors import GuardTripped, Unanswered
from procedures.contracts.steps import Mount, Step
from procedures.execution.context import ExecutionContext
from procedures.execution.reconnect import is_reconnectable
from procedures.recipe.rules import WAITED_FOR


@dataclass
class Recovery:
    """The recoveries of one step, counted."""

    context: ExecutionContext
    step: Step
    suspensions: int = 0
    reconnections: int = 0

    def applies(self, error: BaseException) -> bool:
        """Return whether the step is begun again, or left out, after this error."""
        return self.by_suspension(error) or self.by_reconnection(error) or self.by_skipping(error)

    def by_suspension(self, error: BaseException) -> bool:
        """Return whether the step is begun again once the limits hold."""
        may = self.suspensions < self.context.recipe.guards.max_suspensions
        return isinstance(error, GuardTripped) and error.action in WAITED_FOR and may

    def by_reconnection(self, error: BaseException) -> bool:
        """Return whether the step is begun again once a silent instrument answers."""
        may = self.reconnections + 1 < self.context.recipe.on_failure.link_attempts
        return isinstance(error, LinkError) and may and is_reconnectable(self.context, self.step, error)

    def by_skipping(self, error: BaseException) -> bool:
        """Return whether the step is a mounting that is left out because the question was not answered in time."""
        may = self.context.recipe.on_failure.operator_timeout == "skip"
        return isinstance(error, Unanswered) and isinstance(self.step, Mount) and may
