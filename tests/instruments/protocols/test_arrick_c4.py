"""Command lines of the C4, and the move that gives a constant rate."""

from __future__ import annotations

import pytest

from instruments.protocols import arrick_c4_lines as lines
from instruments.protocols.arrick_c4_moves import SPARE_S, plan_move
from instruments.protocols.arrick_c4_settings import StepperSettings


def test_commands_as_the_public_part_of_the_protocol_lists_them() -> None:
    bodies = (lines.IDENTIFY, lines.HOME, lines.ABORT, lines.STATE, lines.move(4000), lines.move(-12))
    assert [lines.command(body) for body in bodies] == ["!1fp", "!1h1", "!1a", "!1rs", "!1m1f4000n", "!1m1r12n"]


@pytest.mark.parametrize("steps", [1, -1, 4000, -123_456])
def test_a_move_command_is_parsed_back(steps: int) -> None:
    match = lines.MOVE.fullmatch(lines.move(steps))
    assert match is not None
    assert int(match[2]) * (1 if match[1] == "f" else -1) == steps


@pytest.mark.parametrize("rate_dps", [45.0, -45.0, 7.3])
def test_a_move_is_steady_for_the_requested_time(rate_dps: float) -> None:
    settings = StepperSettings(max_rate_dps=100.0, acceleration_dps2=90.0)
    move = plan_move(settings, rate_dps, 10.0)
    step_deg = 360.0 / settings.steps_per_turn
    assert move.divisor == round(2e6 * step_deg / abs(rate_dps))
    assert move.step_hz == 2e6 / move.divisor
    assert move.steady_s >= 10.0 + SPARE_S
    assert move.ramp_s == pytest.approx(move.step_hz * step_deg / 90.0)
    assert move.duration_s == pytest.approx(move.steady_s + 2 * move.ramp_s)
    assert abs(move.steps) == pytest.approx(move.step_hz * move.steady_s + 2 * move.ramp_steps)
    assert (move.steps > 0) == (rate_dps > 0)
