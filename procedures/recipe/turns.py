"""Turns by hand, as a recipe writes them: by which angles, how well known, what is asked, and what is refused."""

from __future__ import annotations

from string import Template
from typing import Annotated

from pydantic import AfterValidator, Field

from instruments.positions import Position
from procedures.recipe.rules import Number, Table, Whole

#: What a text may name: the axis that points up, the angle without its sign, and its sense in words.
WORDS = {"position", "axis", "degrees", "sense"}
MAX_DEG = 36_000.0


def _text(text: str) -> str:
    """Return a text whose words in dollars are known; raises ValueError."""
    template = Template(text)
    unknown = sorted(set(template.get_identifiers()) - WORDS)
    if unknown or not template.is_valid():
        named = f"${unknown[0]} is unknown" if unknown else "a $ stands alone"
        raise ValueError(
            f"{named}; the known placeholders are "
            f"{', '.join(f'${word}' for word in sorted(WORDS))}, and $$ for a dollar sign"
        )
    return text


def _angle(turn_deg: float) -> float:
    if not 0 < abs(turn_deg) <= MAX_DEG:
        raise ValueError(f"the size of a turn must be above 0 deg and at most {MAX_DEG:g} deg, in either direction")
    return turn_deg


Text = Annotated[str, Field(min_length=1, max_length=500), AfterValidator(_text)]
Angle = Annotated[Number, AfterValidator(_angle)]


class Asked(Table):
    """What is asked of the person at the bench, in words."""

    place: Text = "place the units with body axis $position pointing up, against the edge, and release them"
    turn: Text = (
        "turn the units by $degrees deg $sense, seen from above, about body axis $position, which points up; "
        "put them against the edge again and release them"
    )
    keep_still: Text = "keep the units at rest: place them with body axis $position pointing up, against the edge"

    def of(self, text: str, position: str, turn_deg: float = 0.0) -> str:
        """Return one of the texts for a position and an angle, deg."""
        sense = "counter-clockwise" if turn_deg > 0 else "clockwise"
        return Template(text).substitute(
            position=position, axis=Position.of(position).axis, degrees=f"{abs(turn_deg):g}", sense=sense
        )


class TurnRules(Table):
    """Turns by known angles in each position, with a rest before and after each."""

    turns_deg: tuple[Angle, ...] = Field(min_length=1)  #: positive counter-clockwise seen from above
    u_deg: Number = Field(default=1.0, ge=0)  #: standard uncertainty of each turn: how well a hand meets the edge
    common_u: Number | None = Field(default=None, ge=0, lt=0.5)  #: of all turns together, as a share of the angle
    repeats: Whole = Field(default=1, ge=1)  #: how often the turns are gone through in each position
    rest_s: Number = Field(default=10.0, ge=2.0, le=3600.0)
    within_s: Number = Field(default=300.0, gt=0)  #: a question that is not answered for longer ends the campaign
    attempts: Whole = Field(default=10, ge=1)  #: so many refused ones of one turn end the campaign
    #: What may be off, as a share of the angle: the tolerance of the nominal scale factor.
    tolerance: Number = Field(default=0.1, gt=0, lt=0.5)
    still_dps: Number = Field(default=1.0, gt=0)  #: the unit moved in a rest if its output changes by more
    max_lost: Number = Field(default=0.02, ge=0, lt=1)  #: readings of a turn that may be lost or bad, as a share
    ask: Asked = Asked()
