"""Source of the functions in a Python module that a calibration becomes; `{` and `}` are doubled where it is formatted.

The same numbers as the C header's, by the same steps: Horner's scheme, or Lagrange interpolation and Newton's method.
"""

from __future__ import annotations

OPENING = '''"""Correct the output of one gyro. Needs nothing but Python.

{head}

    rates_dps, is_outside = correct(outputs_dps, temperature_c)

outputs_dps: one number for each axis of CALIBRATION["axes"], the output as a rate in deg/s: (output - offset) / scale
by CALIBRATION["output"]. Outside the calibrated range the error at its edge is taken off and is_outside is True.
"""

import math

CALIBRATION = {data}


def _held(value, low, high):
    if low is not None and value < low:
        return low
    return high if high is not None and value > high else value


def _within(value, low, high):
    return value == value and (low is None or value >= low) and (high is None or value <= high)


def correct(outputs_dps, temperature_c):
    """Return the corrected rates, deg/s, and whether output or temperature was outside the calibrated range."""
    known = CALIBRATION
    outputs = [float(value) for value in outputs_dps]
    if len(outputs) != len(known["axes"]):
        raise ValueError("give one output for each axis: " + ", ".join(known["axes"]))
    warm = 0.0 if temperature_c is None and known["temperature_c"][0] is None else float(temperature_c)
    is_outside = not _within(warm, *known["inside_c"])
    is_outside = is_outside or not all(_within(value, *known["output_dps"]) for value in outputs)
    held = [_held(value, *known["output_dps"]) for value in outputs]
    rates = _solved(held, _held(warm, *known["temperature_c"]))
    return [rate + (value - at) for rate, value, at in zip(rates, outputs, held)], is_outside
'''

SURFACE_CORRECTION = '''

def _solved(outputs, warm):
    """error = sum of c[i][j] output^i (temperature - reference_c)^j; rate = output - error."""
    u, rates = warm - CALIBRATION["reference_c"], []
    for output, powers in zip(outputs, CALIBRATION["c"]):
        error = 0.0
        for row in reversed(powers):
            value = 0.0
            for coefficient in reversed(row):
                value = value * u + coefficient
            error = error * output + value
        rates.append(output - error)
    return rates
'''

LINEAR_CORRECTION = '''

def _weights(warm):
    """Lagrange weights of the nodes of temperature that the value is interpolated between: (first node, weights)."""
    nodes, points = CALIBRATION["node_c"], CALIBRATION["points"]
    last = points - 1
    while last < len(nodes) - 1 and warm > nodes[last]:
        last += 1
    first = last - points + 1
    used = nodes[first:last + 1]
    weights = []
    for i, at in enumerate(used):
        weight = 1.0
        for j, other in enumerate(used):
            if j != i:
                weight *= (warm - other) / (at - other)
        weights.append(weight)
    return first, weights


def _solved(outputs, warm):
    """output = K rate + B + (sin(c rate) / c - rate) with c^2 = k_squared, 0 for none; solved by Newton's method."""
    first, weights = _weights(warm)
    axes = range(len(outputs))

    def at(name, *place):
        total = 0.0
        for weight, value in zip(weights, CALIBRATION[name][first:]):
            for index in place:
                value = value[index]
            total += weight * value
        return total

    b, squared = [at("b", a) for a in axes], [at("k_squared", a) for a in axes]
    k = [[at("k", a, other) for other in axes] for a in axes]
    rates = [_begun(outputs[a] - b[a], squared[a]) for a in axes]
    for _ in range(CALIBRATION["steps"]):
        rows = []
        for a in axes:
            sine, slope = _sine(rates[a], squared[a])
            left = b[a] + sine - rates[a] - outputs[a] + sum(k[a][other] * rates[other] for other in axes)
            row = [k[a][other] for other in axes]
            row[a] += max(slope, 1 - CALIBRATION["followed"]) - 1
            rows.append([*row, left])
        rates = [rate - step for rate, step in zip(rates, _eliminated(rows))]
    return rates


def _begun(output, squared):
    if squared == 0:
        return output
    root, most = math.sqrt(max(abs(squared), 1e-12)), CALIBRATION["followed"]
    phase = root * math.radians(output)
    return math.degrees(math.asin(min(max(phase, -most), most)) if squared > 0 else math.asinh(phase)) / root


def _sine(rate, squared):
    """Return sin(c rate) / c, deg/s, and its slope."""
    turned, root = math.radians(rate), math.sqrt(abs(squared))
    phase = root * turned
    if not phase * phase >= 1e-6:  # also not a number
        return rate * (1 - squared * turned * turned / 6), 1 - squared * turned * turned / 2
    if squared > 0:
        return math.degrees(math.sin(phase)) / root, math.cos(phase)
    return math.degrees(math.sinh(phase)) / root, math.cosh(phase)


def _eliminated(rows):
    """Solve equations [coefficients ..., right side] by Gaussian elimination with pivoting."""
    n = len(rows)
    for c in range(n):
        pivot = max(range(c, n), key=lambda r: abs(rows[r][c]))
        rows[c], rows[pivot] = rows[pivot], rows[c]
        for r in range(c + 1, n):
            factor = rows[r][c] / rows[c][c]
            rows[r] = [a - factor * b for a, b in zip(rows[r], rows[c])]
    found = [0.0] * n
    for r in reversed(range(n)):
        found[r] = (rows[r][n] - sum(rows[r][c] * found[c] for c in range(r + 1, n))) / rows[r][r]
    return found
'''

FORCE_CORRECTION = '''

def force_errors(specific_force_g):
    """Return what specific force adds to each output, deg/s: per_g . force + per_g2 * (force along the axis)^2.

    specific_force_g: g along body axes x, y, z, +1 along an axis that points up at rest.
    """
    known = CALIBRATION["specific_force"]
    force = [float(value) for value in specific_force_g]
    if len(force) != 3:
        raise ValueError("give the specific force in g along body axes x, y and z")
    if not all(math.isfinite(value) for value in force):
        return [math.nan for _ in CALIBRATION["axes"]]
    owns = [force["xyz".index(axis)] for axis in CALIBRATION["axes"]]
    return [
        sum(each * value for each, value in zip(row, force)) + square * own * own
        for row, square, own in zip(known["per_g"], known["per_g2"], owns)
    ]


def correct_with_force(outputs_dps, temperature_c, specific_force_g):
    """Return the same as correct, with g-sensitivity corrected."""
    errors, outputs = force_errors(specific_force_g), [float(value) for value in outputs_dps]
    if len(outputs) != len(errors):
        raise ValueError("give one output for each axis: " + ", ".join(CALIBRATION["axes"]))
'''

STATE_CORRECTION = '''

class State:
    """Where the elements are that follow the temperature: of a thermal lag, or of a hysteresis (play).

    A lag moves by d at_c / dt = (temperature - at_c) / tau, exactly for a temperature that goes straight from sample to
    sample; tau is cooling_tau_s while the element is above the temperature. Begins at the first temperature.
    """

    def __init__(self):
        self.t_s = self.temperature_c = self.at_c = None
        self.scales = None

    def errors(self, temperature_c, t_s):
        """Move on to a sample, in order of time (s), and return what the elements add to each output, deg/s.

        What they add to each scale factor is then in `scales`.
        """
        elements, now = CALIBRATION["state"], float(temperature_c)
        if not (math.isfinite(now) and math.isfinite(t_s)):
            return [math.nan for _ in CALIBRATION["axes"]]
        if self.at_c is None:
            self.at_c = [now] * len(elements)
        elif t_s < self.t_s:
            raise ValueError("t_s = %.9g s is before the last sample's %.9g s" % (t_s, self.t_s))
        else:
            self.at_c = [self._moved(each, at, now, t_s) for each, at in zip(elements, self.at_c)]
        self.t_s, self.temperature_c = t_s, now
        sides = [_side(each, at, now) for each, at in zip(elements, self.at_c)]
        self.scales, errors = (
            [sum(size * side for size, side in zip(row, sides)) for row in zip(*rows)]
            for rows in ([each.get("scale", [0.0] * len(each["size"])) for each in elements],
                         [each["size"] for each in elements])
        )
        return errors

    def _moved(self, element, at, now, t_s):
        if element["kind"] == "play":
            half = element["width_k"] / 2
            return min(max(at, now - half), now + half)
        ratio = (t_s - self.t_s) / element["cooling_tau_s" if now < at else "tau_s"]
        keep = math.exp(-ratio)
        mean = -math.expm1(-ratio) / ratio if ratio > 0 else 1.0
        return keep * at + (mean - keep) * self.temperature_c + (1 - mean) * now


def _side(element, at, now):
    if element["kind"] == "lag":
        behind = at - now
        return behind * (at + now - 2 * element["reference_c"]) if element["is_curved"] else behind
    side = (now - at) / (element["width_k"] / 2)
    if element["bow_c"] is None:
        return side
    low, high = element["bow_c"]
    share = min(max((now - low) / max(high - low, 1e-9), 0.0), 1.0)
    return side * 4 * share * (1 - share)


def correct_with_state(state, outputs_dps, temperature_c, t_s):
    """Return the same as correct, with lag and hysteresis corrected; a State for each unit, samples in order."""
    errors, outputs = state.errors(temperature_c, t_s), [float(value) for value in outputs_dps]
    if len(outputs) != len(errors):
        raise ValueError("give one output for each axis: " + ", ".join(CALIBRATION["axes"]))
'''

BEFORE_CORRECTION = """    return correct([output - error for output, error in zip(outputs, errors)], temperature_c)
"""

AFTER_CORRECTION = """    known = [output if error == error else error for output, error in zip(outputs, errors)]
    rates, is_outside = correct(known, temperature_c)
    return [rate - error for rate, error in zip(rates, errors)], is_outside
"""

#: The same where a scale factor lags: solved with the rest by fixed-point steps, until rounding alone is left.
SCALED_BEFORE_CORRECTION = """    left = [output - error for output, error in zip(outputs, errors)]
    scales = state.scales or errors
    rates, is_outside = correct(left, temperature_c)
    rates, before = [rate / (1 + scale) for rate, scale in zip(rates, scales)], math.inf
    for _ in range({steps}):
        held = [_held(rate, *CALIBRATION["output_dps"]) for rate in rates]
        again, _ = correct([output - scale * rate for output, scale, rate in zip(left, scales, held)], temperature_c)
        steps = [(new - rate) / (1 + scale) for new, rate, scale in zip(again, rates, scales)]
        rates = [rate + step for rate, step in zip(rates, steps)]
        change = max((abs(step) for step in steps if step == step), default=0.0)
        if not change < before:
            break
        before = change
    return rates, is_outside
"""

SCALED_AFTER_CORRECTION = """    known = [output if error == error else error for output, error in zip(outputs, errors)]
    rates, is_outside = correct(known, temperature_c)
    held = [_held(output, *CALIBRATION["output_dps"]) for output in outputs]
    more = [error + scale * output for error, scale, output in zip(errors, state.scales or errors, held)]
    return [rate - error for rate, error in zip(rates, more)], is_outside
"""
