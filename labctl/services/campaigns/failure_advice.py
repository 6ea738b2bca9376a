"""A failed campaign in words: what happened, what labctl did, what a person does next."""

from __future__ import annotations

import re
from dataclasses import dataclass

from labctl.answers.campaign_parts import AdviceResponse
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import NOT_SAFE

RESUME = "then resume the campaign"
DID_SAFE = "labctl stopped the table, set the chamber to its safe set point, and kept every data set that was complete."
DID_UNSAFE = (
    "labctl tried to stop the table and to set the chamber to its safe set point, and could not confirm all of it."
)
DID_NOTHING = "labctl did not resume the campaign; every data set that was complete is kept."
LOOK = (
    "Go to the bench, inspect table and chamber, record that with `labctl bench clear` or on the bench page, "
    + RESUME
    + "."
)


@dataclass(frozen=True)
class Failure:
    """One kind of failure, known by the text of its reason."""

    pattern: str
    happened: str
    next: str


#: Kinds of failure by the reason that the engine or the recovery gives; the first that fits counts.
FAILURES: tuple[Failure, ...] = (
    Failure(
        r"not (?:taken up|resumed): bench .* was not confirmed safe",
        "The bench was not confirmed safe when the campaign was to go on.",
        LOOK,
    ),
    Failure(
        r"(?:taken up|resumed) \d+ times without finishing a step",
        "The campaign was resumed several times and never finished a step.",
        f"Find out at the bench what stops the campaign each time, {RESUME}.",
    ),
    Failure(
        r"not (?:taken up|resumed): ",
        "The campaign was interrupted and could not be resumed.",
        f"Correct what the reason names, {RESUME}.",
    ),
    Failure(
        r"could not be made safe first",
        "The campaign was resumed, but the bench could not be made safe first.",
        LOOK,
    ),
    Failure(
        r" declined: ",
        "A person answered that the requested action cannot be done.",
        f"Remove what prevents the action, {RESUME} and answer the campaign's question.",
    ),
    Failure(
        r"^the turn by .* was refused \d+ times",
        "A turn by hand was refused several times.",
        f"Compare the measured angle with the requested angle, check axis, direction and unit, {RESUME} and turn "
        "again.",
    ),
    Failure(
        r"(?:\w+ answered|no answer) within",
        "The bench's question was not answered in time.",
        f"Choose a time when a person is at the bench, {RESUME} and answer the campaign's question.",
    ),
    Failure(
        r"the soak at .* did not settle within",
        "The unit did not settle at its temperature in time.",
        f"Check the air flow around the unit, or allow a longer soak in the recipe, {RESUME}.",
    ),
    Failure(
        r"deg C after .* not within .* of",
        "The chamber did not reach its set point in time.",
        f"Check that the chamber heats and cools and that its door is closed, {RESUME}.",
    ),
    Failure(
        r"set point .* (?:read back|was written, but)",
        "The chamber did not accept the set point that labctl sent.",
        f"Check the controller's panel for a profile, a lock or a limit, {RESUME}.",
    ),
    Failure(
        r": changed by others \(|cannot be taken back",
        "A person changed the chamber at its panel while the campaign needed it.",
        f"Find out who changed it and why; end a profile at the panel, {RESUME}.",
    ),
    Failure(
        r"is set otherwise than before",
        "A unit came back with other settings than it had before.",
        f"Set the unit as it was and save that in the unit, {RESUME}.",
    ),
    Failure(
        r": alarms \(",
        "The chamber's controller reports an alarm.",
        f"Read the alarm at the controller, remove its cause and reset it, {RESUME}.",
    ),
    Failure(
        r"the air is beyond|its own thermometer: ",
        "A temperature passed a limit of the chamber or of a unit.",
        f"Let chamber and unit return to room temperature, find out why the limit was passed, {RESUME}.",
    ),
    Failure(
        r"the air left its set point|is off the air's|differs from the air",
        "The temperature was not steady while readings were taken.",
        f"Check the chamber's door, air flow and controller, {RESUME}.",
    ),
    Failure(
        r" runs .* deg/s instead of|steps took .* instead of|is steady at .* not for the",
        "The table did not turn at the commanded rate.",
        f"Check that the table turns freely and that its cables have enough slack, {RESUME}.",
    ),
    Failure(
        r"still turns|still moves",
        "The table did not come to rest.",
        LOOK,
    ),
    Failure(
        r"readings lost or damaged|readings marked bad|not one of about|none of about|the (?:sample "
        r")?counter on .* (?:does not advance|stands at)",
        "The readings of a unit were missing, damaged or marked bad.",
        f"Check the unit's power, cable and baud rate, {RESUME}.",
    ),
    Failure(
        r"nothing heard|no answer|gave no (?:complete )?answer|no intact |no whole line|no complete "
        r"line|does not answer|link .* broke|"
        r"cannot be opened|no Modbus TCP|reply belongs to another request|not reached again|"
        r"link is gone|the link (?:.* )?was lost|(?:came|arrived) that are no|answered instead of "
        r"unit|reply to request|line was never silent|"
        r"no Modbus instrument|not a Modbus instrument|, no Modbus;|instead of a Modbus reply",
        "An instrument did not answer.",
        f"Check the instrument's power and cable, run `labctl bench check`, {RESUME}.",
    ),
    Failure(
        r"check (?:the )?address(?: and|, or the) driver|not a C4|not the answer of a C4|, serial |is set otherwise|"
        r"is not configured as|readings/s on |has serial number|on USB adapter",
        "The instrument that answered is not the instrument in the bench file.",
        f"Compare the bench file with the bench, {RESUME}.",
    ),
    Failure(
        r"database|disk|could be written|could not be written",
        "The database could not be written.",
        f"Free disk space or repair the database, inspect the bench, {RESUME}.",
    ),
    Failure(
        r"^ended by an error of the program|^[A-Za-z_.]*(Error|Exception)\b",
        "labctl failed because of a fault in labctl itself.",
        f"Report the reason with the version of labctl, inspect the bench, {RESUME}.",
    ),
)
OTHER = Failure("", "A step of the campaign could not be carried out.", f"Correct what the reason names, {RESUME}.")


def advice_of(state: CampaignState, reason: str) -> AdviceResponse | None:
    """Return the advice on a campaign by its reason; None unless it has failed."""
    if state is not CampaignState.FAILED:
        return None
    unsafe = NOT_SAFE in reason
    cause = reason.partition(NOT_SAFE)[0] or reason
    failure = next((each for each in FAILURES if re.search(each.pattern, cause)), OTHER)
    done = DID_UNSAFE if unsafe else DID_NOTHING if re.search("taken up|resumed", cause) else DID_SAFE
    return AdviceResponse(happened=failure.happened, done=done, next=LOOK if unsafe else failure.next)
