"""The equation of each effect, evaluated beside the effect's own columns, and what its symbols and sources say."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import roots_genlaguerre

from labctl.fitting.data.channels import BODY_AXES, Channels, body_rates
from labctl.fitting.data.response import Response
from labctl.fitting.data.temperature.history import SPACING_S, TemperatureHistory, TemperatureProfile
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.fitting.effects.base import Column, Reference
from labctl.fitting.effects.catalogue import EFFECTS
from labctl.fitting.effects.equation import CHANNELS
from labctl.fitting.effects.mathml import NAMESPACE, equation_mathml, expression, symbol_mathml

Names = dict[str, Any]
ROWS = 40
COURSE = 25  #: temperatures of the course, every 10 s
REFERENCE = Reference(23.0)
#: Relative to the largest value of a column.
CLOSE = 1e-12
OWN = {kind.id: kind() for kind in EFFECTS}
#: Terms beside the default one that an equation covers: a case for each branch.
CASES: Mapping[str, list[dict[str, float]]] = {
    "centripetal_acceleration": [{"by_position": 0.0}, {"by_position": 1.0}],
    "table_tilt": [{"wobbles": 0.0}, {"wobbles": 1.0}],
    "temperature_rate": [{"over_s": 60.0}, {"of_gradient": 1.0}],
    "thermal_lag": [{}, {"second_tau_s": 900.0, "curved": 1.0}],
    "scale_factor_lag": [{}, {"second_tau_s": 900.0, "curved": 1.0}],
    "thermal_hysteresis": [{}, {"bowed": 1.0}, {"rounded": 1.0}, {"rounded": 1.0, "bowed": 1.0}],
    "rate_hysteresis": [{"by_sign": 0.0}, {"by_sign": 3.0}],
}


def upto(low: int, high: int) -> range:
    return range(int(low), int(high) + 1)


def in_steps_of_two(low: int, high: int) -> range:
    return range(low, high + 1, 2)


FUNCTIONS: Names = {
    "sum": sum, "upto": upto, "even": in_steps_of_two, "odd": in_steps_of_two, "round": round, "pi": np.pi,
    "others": lambda axis: [other for other in BODY_AXES if other != axis], "abs": np.abs, "ln": np.log,
    "min": np.minimum, "max": np.maximum,
    **{name: getattr(np, name) for name in ("exp", "sqrt", "sin", "cos", "tanh", "sign", "floor")},
}  # fmt: skip


class ByRow:
    """A coefficient for each number or position: the value of the row's own."""

    def __init__(self, values: Mapping[Any, float]) -> None:
        self.values = values

    def __getitem__(self, of: Any) -> Any:
        if isinstance(of, np.ndarray):
            return np.array([self.values.get(each, 0.0) for each in of.tolist()])
        return self.values[of]


def channels_of(seed: int, course_c: np.ndarray) -> Channels:
    """Return random data sets: each channel that an equation names, with a course of the temperature."""
    rng = np.random.default_rng(seed)
    position = rng.choice(["x", "-x", "y", "-y", "z", "-z"], ROWS)
    rate = np.concatenate([[0.0, 0.02, -0.02], rng.uniform(-300, 300, ROWS - 3)])
    t_s = 1000.0 + SPACING_S * rng.integers(0, len(course_c), ROWS)
    columns = {
        "table_rate_dps": rate, "position": position, "t_s": t_s, "chamber_c": rng.uniform(10, 60, ROWS),
        "temperature_c": course_c[((t_s - 1000.0) / SPACING_S).astype(int)], "power_s": rng.uniform(0, 4000, ROWS),
        "supply_v": rng.uniform(4, 6, ROWS), "previous_rate_dps": rng.uniform(-300, 300, ROWS),
        "table_angle_deg": rng.uniform(0, 360, ROWS), "duration_s": np.zeros(ROWS),
        "since_begin_s": rng.uniform(0, 30, ROWS), "run": np.ones(ROWS, dtype=np.int64),
        "mounting": rng.integers(1, 4, ROWS),
    }  # fmt: skip
    history = TemperatureHistory(
        {1: TemperatureProfile(1000.0, course_c)}, {"run": (1, 2, 3), "mounting": (1, 2, 3)}, 300.0,
        (float(course_c.min()), float(course_c.max())), middle_s=1111.0,
    )  # fmt: skip
    rates = body_rates(rate, position)
    if seed % 2:  # turned about all axes at once
        rates = {axis: rng.uniform(-300, 300, ROWS) for axis in BODY_AXES}
        columns |= {f"accel_{axis}_g": rng.uniform(-2, 2, ROWS) for axis in BODY_AXES}
    return Channels(columns, rates, history)


def course(seed: int, direction: int = 0) -> np.ndarray:
    """Return random temperatures, (k,) deg C; rising or falling all the time with a `direction`."""
    steps = np.random.default_rng(seed).uniform(-4.0, 4.0, COURSE)
    return 30.0 + np.cumsum(direction * np.abs(steps) if direction else steps)


def names_of(channels: Channels, axis: str, effect: Effect, term: Term) -> Names:
    """Return what the symbols of the channels and the parameters stand for."""
    columns, history = channels.columns, channels.history
    force = {a: columns[f"accel_{a}_g"] if f"accel_{a}_g" in columns else channels.up(a) for a in BODY_AXES}
    temperatures = history.profiles[1].temperature_c
    at = ((np.asarray(columns["t_s"], dtype=np.float64) - 1000.0) / SPACING_S).astype(int)
    names: Names = {
        **FUNCTIONS, "a": axis, "omega": channels.rates, "omega_t": columns["table_rate_dps"], "f": force,
        "omega_b": columns["previous_rate_dps"], "omega_max": history.rate_dps, "T_ref": REFERENCE.temperature_c,
        "T_c": columns["chamber_c"], "t_on": columns["power_s"], "theta": np.deg2rad(columns["table_angle_deg"]),
        "u": {a: channels.up(a) for a in BODY_AXES}, "V": columns["supply_v"], "t_m": 1111.0,
        "t_d": columns["since_begin_s"], "L": columns["duration_s"], "p": columns["position"],
        "r": columns["run"], "m": columns["mounting"], "n": effect.order(term),
        "T_min": history.span_c[0], "T_max": history.span_c[1],
    }  # fmt: skip
    if effect.id == "thermal_hysteresis":  # of another library than the code's own
        nodes, weights = roots_genlaguerre(4, 1.0)
        names |= {"r": dict(enumerate(nodes, 1)), "p": dict(enumerate(weights, 1))}
    if effect.id == "temperature_rate":
        padded = lambda t_s: temperatures[np.clip(((t_s - 1000.0) / SPACING_S).astype(int), 0, COURSE - 1)]  # noqa: E731
        names |= {"t": columns["t_s"], "T": padded}
        if term.parameters.get("of_gradient"):
            names["T"] = columns["temperature_c"]
    else:
        names |= {"t": columns["t_s"], "T": columns["temperature_c"]}
    for parameter in effect.parameters:
        names[parameter.symbol or parameter.name] = term.parameters.get(parameter.name, 0.0)
    return {**names, "course": temperatures, "at": at}


def value(text: str, names: Names) -> Any:
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return eval(compile(text, "equation", "eval"), {"__builtins__": {}, **names})


def lines_of(effect: Effect, names: Names) -> Names:
    """Return the names with what the lines below the equation define, last line first."""
    equation = effect.equation
    assert equation is not None
    for left, right in reversed(equation.where):
        if left.startswith("d("):
            symbol = left[2 : left.index(")")]
            names[symbol] = followed(symbol, right, names)[names["at"]]
        elif left == "P(W)":
            names["P"] = lambda width, right=right: played(width, right, dict(equation.where)["T_p"], names)
        elif left not in ("T_p", "tau_T") and not (left == "Tdot" and names["of_gradient"]):
            names[left] = value(right, names)
    return names


def followed(symbol: str, slope: str, names: Names) -> np.ndarray:
    """Return the solution of d(symbol)/d(t) = slope at the temperatures of a course, straight between them."""
    temperatures = names["course"]
    if not names["tau_2"] and symbol == "T_2":
        return np.zeros(len(temperatures))  # there is no second element

    def derivative(t_s: float, now: np.ndarray) -> Any:
        at = {**names, "T": np.interp(t_s, SPACING_S * np.arange(len(temperatures)), temperatures), symbol: now[0]}
        at["tau_T"] = at["tau_c"] if at["tau_c"] and at[symbol] > at["T"] else at["tau"]
        return [value(slope, at)]

    solved = [temperatures[0]]
    for k in range(1, len(temperatures)):
        span = (SPACING_S * (k - 1), SPACING_S * k)
        solved.append(solve_ivp(derivative, span, solved[-1:], "DOP853", rtol=1e-13, atol=1e-13).y[0, -1])
    return np.array(solved)


def played(width: float, state: str, follower: str, names: Names) -> Any:
    """Return the state of a play at the rows, from the follower's value at each temperature before."""
    before, states = names["course"][0], []
    for temperature in names["course"]:
        before = value(follower, {**names, "T": temperature, "T_b": before, "W": width})
        states.append(value(state, {**names, "T": temperature, "T_p": before, "W": width}))
    return np.array(states)[names["at"]]


def _index(key: tuple[int | str, ...]) -> Any:
    """Return one index alone, several as a tuple."""
    return key if len(key) > 1 else next(iter(key))


def coefficients_of(
    effect: Effect, columns: list[Column], axis: str, rng: np.random.Generator
) -> tuple[Names, dict[str, float]]:
    """Return random coefficients as the symbols of the equation and as name of the column -> value."""
    estimated = {
        column.name: float(rng.uniform(0.2, 1.5)) * (1 if column.law else rng.choice([-1, 1])) for column in columns
    }
    symbols: Names = {}
    explained: set[str] = set()
    assert effect.equation is not None
    for each in effect.equation.coefficients:
        stem, _, index = each.symbol.partition("[")
        pattern = re.compile(re.sub(r"\\\{\w\\\}", "(.+)", re.escape(each.name)) + "$")
        found = {
            tuple(int(key) if key.isdigit() else key for key in match.groups()): amount
            for name, amount in estimated.items()
            if (match := pattern.match(name))
        }
        if each.name == "k":  # estimated as its square
            symbols[stem] = np.sqrt(estimated["k_squared"])
        elif not index:
            symbols.setdefault(stem, next(iter(found.values()), 0.0))
        elif index.startswith("a,"):
            symbols[stem] = {(axis, *key): amount for key, amount in found.items()}
        elif found:
            symbols[stem] = ByRow({_index(key): amount for key, amount in found.items()})
        explained |= {name for name in estimated if pattern.match(name)} | (
            {"k_squared"} if each.name == "k" else set()
        )
    assert explained == set(estimated)
    return symbols, estimated


def compare(effect: Effect, channels: Channels, term: Term, axis: str) -> None:
    rng = np.random.default_rng(7)
    columns = effect.columns(channels, axis, term, REFERENCE)
    names = names_of(channels, axis, effect, term)
    symbols, estimated = coefficients_of(effect, columns, axis, rng)
    names = lines_of(effect, names | symbols)
    parts = [each.error_dps(np.full(len(channels), estimated[each.name])) for each in columns]
    waves = [1.0 if each.carrier is None else channels.harmonic(each.carrier) for each in columns]
    own = np.sum([part * wave for part, wave in zip(parts, waves, strict=True)], axis=0)
    assert effect.equation is not None
    written = np.broadcast_to(value(effect.equation.error, names), len(channels))
    scale = max(float(np.abs(np.array(parts)).max()), 1e-9)
    assert np.abs(own).max() > 0 or axis not in channels.rates
    np.testing.assert_allclose(written, own, rtol=0, atol=CLOSE * scale)


RESPONSES = ("time_delay", "bandwidth")


@pytest.mark.parametrize("effect_id", [each for each in OWN if each not in RESPONSES])
def test_the_equation_is_what_is_computed(effect_id: str) -> None:
    effect = OWN[effect_id]
    orders = [None] if effect.max_order is None else range(effect.min_order, effect.max_order + 1)
    usual = {p.name: 0.3 * p.low + 0.1 * p.high if p.logarithmic else (p.low + p.high) / 2 for p in effect.parameters}
    switches = {p.name: 0.0 for p in effect.parameters if not p.symbol or p.name == "by_sign"}
    left_out = {"second_tau_s", "cooling_tau_s"}
    usual = {name: amount for name, amount in (usual | switches).items() if name not in left_out}
    if "per_turn" in usual:
        usual["per_turn"] = 4.0
    for seed in (2, 3):
        channels = channels_of(seed, course(seed))
        if effect_id == "start_transient":
            channels = replace(channels, columns={**channels.columns, "duration_s": np.linspace(0.5, 60, ROWS)})
        if effect_id == "run_shift":
            channels = replace(channels, columns={**channels.columns, "run": 1 + np.arange(ROWS) % 3})
        for order in orders:
            for case in CASES.get(effect_id, [{}]):
                for axis in ("x", "z"):
                    compare(effect, channels, Term(effect_id, order, usual | case), axis)


@pytest.mark.parametrize("direction", [1, -1])
def test_a_lag_has_a_time_constant_of_its_own_while_cooling(direction: int) -> None:
    term = Term("thermal_lag", None, {"tau_s": 300.0, "cooling_tau_s": 40.0})
    compare(OWN["thermal_lag"], channels_of(2, course(5, direction)), term, "x")


class Wave:
    """A rate that swings: what comes through a response is known in closed form."""

    RAD_S = 2 * np.pi * 3.0

    def __init__(self) -> None:
        self.t_s = np.linspace(0.0, 1.0, ROWS)

    def seen_dps(self, response: Response) -> np.ndarray:
        return np.real(100.0 * response.gain(np.array([self.RAD_S])) * np.exp(1j * self.RAD_S * self.t_s))

    def slope(self, name: str, response: Response) -> np.ndarray:
        return np.real(100.0 * response.slope(name, np.array([self.RAD_S])) * np.exp(1j * self.RAD_S * self.t_s))


@pytest.mark.parametrize("effect_id", RESPONSES)
def test_the_equation_of_a_response_is_what_is_computed(effect_id: str) -> None:
    effect, wave = OWN[effect_id], Wave()
    channels = replace(channels_of(2, course(2)), profile=wave)  # type: ignore[arg-type]
    channels = replace(channels, columns={**channels.columns, "position": np.full(ROWS, "z")})
    (column,) = effect.columns(channels, "z", Term(effect_id), REFERENCE)
    amount = 0.02
    own = column.error_dps(np.full(ROWS, amount))
    swing = SimpleNamespace(z=lambda t_s: 100.0 * np.cos(wave.RAD_S * t_s))
    assert effect.equation is not None
    if effect_id == "time_delay":
        names = {"omega_a": swing.z, "a": "z", "t": wave.t_s, "delta": amount}
        written = value(effect.equation.error, names)
    else:  # the swing behind the filter, put into the line that defines it
        lag = np.arctan(wave.RAD_S * amount)
        size = 100.0 * np.cos(lag)
        behind, slope = (
            size * np.cos(wave.RAD_S * wave.t_s - lag),
            -size * wave.RAD_S * np.sin(wave.RAD_S * wave.t_s - lag),
        )
        names = {"omega": {"z": swing.z(wave.t_s)}, "a": "z", "tau": amount, "omega_l": behind}
        np.testing.assert_allclose(value(effect.equation.where[0][1], names), slope, atol=1e-10 * np.abs(slope).max())
        written = value(effect.equation.error, names)
    np.testing.assert_allclose(written, own, rtol=0, atol=CLOSE * 100)


@pytest.mark.parametrize("effect_id", list(OWN))
def test_every_symbol_has_a_meaning_and_a_unit_and_every_effect_a_source(effect_id: str) -> None:
    effect = OWN[effect_id]
    equation = effect.equation
    assert equation is not None
    explained = {re.split(r"\W", each.symbol)[0] for each in (*equation.coefficients, *equation.others)}
    explained |= {p.symbol or p.name for p in effect.parameters} | set(CHANNELS)
    used = set()
    for text in (equation.error, *(part for line in equation.where for part in line)):
        used |= {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
    assert used - explained - set(FUNCTIONS) - {"d"} == set()
    coefficients = {re.split(r"\W", each.symbol)[0] for each in equation.coefficients}
    assert coefficients <= used
    assert all(parameter.meaning and parameter.unit for parameter in effect.parameters)
    assert effect.sources
    assert all(source.work and source.place for source in effect.sources)


@pytest.mark.parametrize("effect_id", list(OWN))
def test_the_mathml_is_well_formed_and_has_every_symbol_and_number(effect_id: str) -> None:
    equation = OWN[effect_id].equation
    assert equation is not None
    root = ElementTree.fromstring(equation_mathml(equation))
    assert root.tag == f"{{{NAMESPACE}}}math"
    assert len(root[0]) == 1 + len(equation.where)  # one row for each line
    for row, (_, right) in zip(root[0], [("", equation.error), *equation.where], strict=True):
        numbers = set(re.findall(r"(?<![\w.])\d+(?:\.\d+)?", right))
        drawn = {each.text for each in row.iter() if each.tag.rpartition("}")[2] in ("mn", "mtext")}
        assert numbers <= {part for text in drawn if text for part in re.split(r"[, ]+", text)}
    for each in equation.coefficients:
        ElementTree.fromstring(symbol_mathml(each.symbol))


@pytest.mark.parametrize(
    ("text", "drawn"),
    [
        ("a - (b - c)", "a−(b−c)"),
        ("(a + b) * c", "(a+b)⁢c"),
        ("(a * b)**2", "(a⁢b)2"),
        ("-(a + b)", "−(a+b)"),
        ("abs(omega_t)", "|ωt|"),
        ("sum(b[k] for k in upto(1, n)) * c", "∑k=1nbk⁢c"),
        ("sum(m[a, j] for j in others(a))", "∑j≠ama,j"),
    ],
)
def test_parentheses_and_bounds_are_drawn(text: str, drawn: str) -> None:
    assert "".join(ElementTree.fromstring(f"<math>{expression(text)}</math>").itertext()) == drawn


def test_what_has_no_notation_is_refused() -> None:
    with pytest.raises(ValueError, match="Lambda has no notation"):
        expression("lambda x: x")


def test_every_effect_of_the_catalogue_has_an_equation() -> None:
    assert [each.id for each in CATALOGUE.values() if each.equation is None] == []
