"""A turn by hand in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from labctl.answers.campaigns import CampaignResponse


def turn_text(answer: CampaignResponse) -> str:
    """Return how far a turn by hand has come; empty where none is under way."""
    turn = answer.turn
    if turn is None:
        return ""
    if turn.phase == "rest":
        return f"keep the unit still, axis {turn.position} pointing up"
    came = ", ".join(f"{deg:.0f}" for deg in turn.came_deg.values()) or "nothing"
    return f"turned so far: {came} of {turn.asked_deg:g} deg about axis {turn.position}"
