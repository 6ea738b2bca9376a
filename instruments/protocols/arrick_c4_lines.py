"""Command and reply syntax of the Arrick C4 stepper controller: ASCII lines, one controller address, one motor.

Only finite moves, the abort, the state, homing and the identity are public. The speed and ramp commands come from the
templates of the bench file (`table.speed_template`, `table.ramp_template`).
"""

from __future__ import annotations

import re

#: Every command to controller 1 begins with this prefix.
PREFIX = "!1"
IDENTIFY, STATE, ABORT, HOME = "fp", "rs", "a", "h1"
#: Text that the reply to IDENTIFY begins with.
IDENTITY_PREFIX = "C4"
ACCEPTED, FINISHED, IDLE = "a", "o", "0"
#: Homes both motors: one `o` for each.
HOME_BOTH = "h12"
#: Body of a parameter command, as `wh1,r,200`: acknowledged by a line.
PARAMETER = re.compile(r"w[a-z].*")
#: Body of a move command: direction `f` or `r`, then the number of half steps.
MOVE = re.compile(r"m1([fr])(\d+)n")


#: What to do where the answer is the command itself.
ECHO_ADVICE = "the line echoes what labctl sends: switch the local echo of the adapter off, and check wires and power"


def is_echo(text: str) -> bool:
    """Return whether a line that came is a command."""
    return text.startswith(PREFIX)


def command(body: str) -> str:
    """Return the command line of a body, without its terminator."""
    return PREFIX + body


def move(steps: int) -> str:
    """Return the body of a move by a signed number of half steps; a positive number turns `f`."""
    return f"m1{'f' if steps > 0 else 'r'}{abs(steps)}n"
