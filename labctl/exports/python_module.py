"""A calibration as a Python module that imports nothing but the standard library: a dictionary and `correct`."""

from __future__ import annotations

import math
import pprint

import numpy as np

from labctl.answers.json_object import JsonObject
from labctl.calibration import Calibration
from labctl.compensator import MARGIN_C, output_limits_dps
from labctl.errors import BadInput
from labctl.exports.c_code.nodes import temperature_nodes
from labctl.exports.comments import head_lines
from labctl.exports.force_text import size_line
from labctl.exports.format import Format, Loss, Written
from labctl.exports.python_source import (
    AFTER_CORRECTION,
    BEFORE_CORRECTION,
    FORCE_CORRECTION,
    LINEAR_CORRECTION,
    OPENING,
    SCALED_AFTER_CORRECTION,
    SCALED_BEFORE_CORRECTION,
    STATE_CORRECTION,
    SURFACE_CORRECTION,
)
from labctl.fitting.models.correction import SCALE_STEPS
from labctl.fitting.models.force_sensitivity import ForceSensitivity
from labctl.fitting.models.matrix_form import linear_of
from labctl.fitting.models.memory import split_memory
from labctl.fitting.models.polynomial_surface import surface_of
from labctl.fitting.models.sine_form import FOLLOWED, STEPS, sine_form_of

NAME = "python"
#: Python's floats are labctl's; sums in another order differ by this, deg/s at most (tests hold it to this).
DIFFERS_DPS = 1e-9


def write(calibration: Calibration) -> Written:
    """Return the module; raises BadInput for a model that has no closed form."""
    fitted, memory = split_memory(calibration.fitted, calibration.axes)
    tables, body = _tables(calibration)
    if tables is None:
        raise BadInput(
            f"format {NAME}: model {calibration.fitted.model.name} has effects without a closed form "
            f"({', '.join(fitted.model.effect_ids)}); use the JSON file with labctl's Compensator"
        )
    losses: tuple[Loss, ...] = ()
    slowest, fastest = output_limits_dps(calibration)
    low, high = calibration.temperature_c
    content = {
        "serial": calibration.serial,
        "version": calibration.version,
        "hash": calibration.calibration_hash,
        "model": calibration.fitted.model.name,
        **({"configuration": calibration.configuration} if calibration.configuration else {}),
        "axes": list(calibration.axes),
        "temperature_c": [_limit(low), _limit(high)],
        "inside_c": [_limit(low - MARGIN_C), _limit(high + MARGIN_C)],
        "output_dps": [_limit(slowest), _limit(fastest)],
        "output": {
            axis: {"unit": output.unit, "offset": output.offset, "scale": output.scale}
            for axis, output in calibration.output.items()
        },
        **tables,
    }
    is_direct = fitted.model.argument == "output"
    around = AFTER_CORRECTION if is_direct else BEFORE_CORRECTION
    force, notes = calibration.force_sensitivity, []
    if memory is not None:
        content["state"] = [follower.to_json() for follower in memory.followers]
        scaled = SCALED_AFTER_CORRECTION if is_direct else SCALED_BEFORE_CORRECTION.format(steps=SCALE_STEPS)
        body += STATE_CORRECTION + (scaled if memory.has_scale else around)
        notes.append("correct_with_state corrects the thermal lag or hysteresis; correct alone leaves it.")
    if force is not None:
        content["specific_force"] = _force_table(force)
        body += FORCE_CORRECTION + around
        notes += [size_line(force, "correct_with_force") + "."]
    carries = "the whole correction, in double precision, for any Python from 3.8 on"
    head = "\n".join(head_lines(calibration, carries, DIFFERS_DPS, losses, notes)).replace("\\", "/").replace('"', "'")
    data = pprint.pformat(content, width=110, sort_dicts=False)
    text = OPENING.format(head=head, data=data) + body
    return Written(text.encode("utf-8"), losses, DIFFERS_DPS)


def _tables(calibration: Calibration) -> tuple[JsonObject | None, str]:
    """Return the model's tables and the function that evaluates them; None for a model of another form."""
    fitted, _ = split_memory(calibration.fitted, calibration.axes)
    surface = surface_of(fitted, calibration.axes)
    if surface is not None:
        return {"reference_c": surface.reference_c, "c": surface.coefficients.tolist()}, SURFACE_CORRECTION
    sine = sine_form_of(fitted, calibration.axes)
    linear = sine.linear if sine is not None else linear_of(fitted, calibration.axes)
    if linear is None:
        return None, ""
    nodes_c, points = temperature_nodes(linear, calibration.temperature_c)
    k, b = linear.k_and_b(nodes_c)
    squared = np.zeros_like(b) if sine is None else sine.k_squared(nodes_c)
    return {
        "points": points, "node_c": nodes_c.tolist(), "k": k.tolist(), "b": b.tolist(), "k_squared": squared.tolist(),
        "steps": STEPS if sine is not None else 1, "followed": FOLLOWED,
    }, LINEAR_CORRECTION  # fmt: skip


def _force_table(force: ForceSensitivity) -> JsonObject:
    return {
        "at_1_g_dps": force.at_1_g_dps.tolist(), "per_g": force.known_per_g.tolist(),
        "per_g2": force.known_per_g2.tolist(), "not_measured": force.not_measured,
    }  # fmt: skip


def _limit(value: float) -> float | None:
    return value if math.isfinite(value) else None


FORMAT = Format("Python module", "text/x-python", "py", write)
