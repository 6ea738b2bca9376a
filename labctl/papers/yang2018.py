"""Yang, Zhou, Wang, Xing, Zhang 2018: a tri-axial MEMS gyro over the full temperature range."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import sqrt

import numpy as np

from labctl.papers.paper import Contradiction, Paper, Printed

AXES = "xyz"
#: Table 1 and Table 2.
TEMPERATURES_C = (-40.0, -30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0, 50.0)
RATES_DPS = (0.0, *(sign * rate for rate in (0.1, 1.0, 10.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 400.0)
                    for sign in (1, -1)))  # fmt: skip
#: What the printed errors show beside Table 2.
MISSING_RATES_DPS = (350.0, -350.0)
#: K_g at 25 deg C as printed, without signs: K_ij multiplies the rate about i in output j; B in deg/s.
NAMES = ("Kxx", "Kyy", "Kzz", "Kyx", "Kzx", "Kxy", "Kzy", "Kxz", "Kyz", "Bx", "By", "Bz")
PROPOSED = (1.0005, 1.0005, 1.0017, 0.0188, 0.0012, 0.0187, 5.2027e-4, 0.0011, 7.5133e-4, 0.0303, 0.0435, 0.0261)
TRADITIONAL = (1.001, 1.0001, 1.0017, 0.018, 0.0013, 0.0187, 5.3089e-4, 0.0011, 7.6320e-4, 0.0316, 0.0488, 0.0232)
#: Table 3, deg/s, by axis that turns and output: mean and RMS before, mean and RMS after.
TABLE_3 = {
    "x": {"x": (-0.0302, 0.1783, 0.0013, 0.0532), "y": (-0.0538, 4.0177, -0.0050, 0.0011),
          "z": (-0.0242, 0.2459, -0.0099, 0.0015)},
    "y": {"x": (-0.0330, 4.0446, -0.0014, 0.0018), "y": (-0.0471, 0.1789, 0.0017, 0.0568),
          "z": (-0.0197, 0.1644, 0.0035, 0.0011)},
    "z": {"x": (-0.0315, 0.2696, 1.26e-4, 9.25e-4), "y": (-0.0455, 0.1143, 0.0033, 0.0016),
          "z": (-0.0257, 0.3621, -0.0025, 0.0263)},
}  # fmt: skip
TABLE_3_COLUMNS = ("mean before", "RMS before", "mean after", "RMS after")
#: Table 4, deg/s: uncompensated, traditional, proposed. The last block, turning about z, holds means.
TABLE_4 = {
    "x": {"x": (0.1453, 0.1271, 0.0931), "y": (3.9339, 0.0474, 0.0473), "z": (0.2391, 0.0492, 0.0488)},
    "y": {"x": (3.9576, 0.0467, 0.0467), "y": (0.1374, 0.1287, 0.0957), "z": (0.1656, 0.0486, 0.0486)},
    "z": {"x": (-0.0307, 9.855e-4, -4.386e-4), "y": (-0.0418, 0.0069, 0.0017), "z": (-0.0292, -0.0060, -0.0031)},
}
TABLE_4_COLUMNS = ("uncompensated", "traditional", "proposed")
#: Percentages that the paper prints for Table 4, by axis that turns and output: proposed against traditional.
PRINTED_GAINS = {"x": {"x": 26.75, "y": 2.110, "z": 8.130}, "z": {"x": 55.50, "y": 75.36, "z": 48.33}}
#: The block of Table 4 that holds means instead of RMS values.
MEANS = "z"
#: Largest error of an axis that is not turned, deg/s, at 400 deg/s.
CROSS_DPS = 7.48


def rms_of(rates_dps: tuple[float, ...]) -> float:
    """Return the root mean square of rates, deg/s."""
    return float(np.sqrt(np.mean(np.square(rates_dps))))


def gain_pct(turning: str, output: str, against: str) -> float:
    """Return by how much the proposed method is below another column of Table 4, per cent, by the printed errors."""
    before, after = (TABLE_4[turning][output][TABLE_4_COLUMNS.index(name)] for name in (against, "proposed"))
    return 100.0 * (1.0 - abs(after) / abs(before))


def unexplained_dps(axis: str) -> tuple[float, float, float]:
    """Return what K and B leave of the printed own-axis error of Table 4, deg/s RMS, and its range by K's rounding.

    Over rates without a mean the squares add: before^2 = (K - 1)^2 RMS(rates)^2 + B^2 + rest^2. Turning about z Table 4
    prints means, so Table 3 is taken there.
    """
    which = AXES.index(axis)
    before = TABLE_3[axis][axis][1] if axis == MEANS else TABLE_4[axis][axis][0]
    bias, rates = PROPOSED[9 + which], rms_of((*RATES_DPS, *MISSING_RATES_DPS))

    def rest(scale: float) -> float:
        return sqrt(max(before**2 - (scale * rates) ** 2 - bias**2, 0.0))

    scale = PROPOSED[which] - 1.0
    return rest(scale), rest(scale + 0.5e-4), rest(scale - 0.5e-4)


def _printed() -> Iterator[Printed]:
    for node, temperature in enumerate(TEMPERATURES_C):
        yield Printed(f"temperature_{node}", "Table 1", f"temperature {node + 1}", "deg C", temperature)
    for row, rate in enumerate(RATES_DPS):
        yield Printed(f"rate_{row}", "Table 2", f"rate {row + 1}", "deg/s", rate)
    for kind, coefficients in (("proposed", PROPOSED), ("traditional", TRADITIONAL)):
        for name, value in zip(NAMES, coefficients, strict=True):
            unit = "deg/s" if name[0] == "B" else "1"
            yield Printed(f"{kind}_{name}", "K_g at 25 deg C", f"{name}, {kind}", unit, value)
    yield Printed("cross_max", "Text", "largest cross-axis error before, at 400 deg/s", "deg/s", CROSS_DPS)
    yield from _cells(3, TABLE_3, TABLE_3_COLUMNS)
    yield from _cells(4, TABLE_4, TABLE_4_COLUMNS)
    for turning, outputs in TABLE_4.items():
        for output in outputs:
            for against in TABLE_4_COLUMNS[:2]:
                yield Printed(
                    f"gain_{turning}_{output}_{against}", "Table 4, reductions",
                    f"turning about {turning}, output {output}: proposed against {against}", "%",
                    gain_pct(turning, output, against),
                )  # fmt: skip
    for axis in AXES:
        after = TABLE_3[axis][axis][3] if axis == MEANS else TABLE_4[axis][axis][2]
        table_name = "Table 3" if axis == MEANS else "Table 4"
        yield Printed(
            f"curve_{axis}", "Own-axis remainder",
            f"{axis}: RMS after ({table_name}), beside what K and B do not explain "
            "of the RMS before", "deg/s", after,
        )  # fmt: skip
    yield Printed("stalled", "The missing effect", "yang2018: RMS error, all axes and positions", "deg/s", None)
    yield Printed("improved", "The missing effect", "with the named effect: RMS error", "deg/s", None)
    yield Printed("improved_heldout", "The missing effect", "the same, temperatures left out", "deg/s", None)
    yield Printed("floor", "The missing effect", "noise floor of a data set", "deg/s", None)


def _cells(
    number: int, table: Mapping[str, Mapping[str, Sequence[float]]], columns: tuple[str, ...]
) -> Iterator[Printed]:
    for turning, outputs in table.items():
        means = " (a mean)" if number == 4 and turning == MEANS else ""
        for output, values in outputs.items():
            for column, value in zip(columns, values, strict=True):
                quantity = f"turning about {turning}, output {output}: {column}{means}"
                yield Printed(f"table{number}_{turning}_{output}_{column}", f"Table {number}", quantity, "deg/s", value)


def _of_the_tables() -> Iterator[Contradiction]:
    full = (*RATES_DPS, *MISSING_RATES_DPS)
    printed = [TABLE_4["x"]["y"][0] / PROPOSED[5], TABLE_4["y"]["x"][0] / PROPOSED[3]]
    third = [TABLE_3["x"]["y"][1] / PROPOSED[5], TABLE_3["y"]["x"][1] / PROPOSED[3]]
    yield Contradiction(
        "Table 2 against the equations",
        f"Table 2 prints {len(RATES_DPS)} rates, the equations have 69 = 3 x {len(full)} rows. The cross-axis RMS "
        f"before compensation of Table 4 over Kxy and Kyx is the RMS of the rates: {printed[0]:.1f} and "
        f"{printed[1]:.1f} deg/s. {len(full)} rates with +-350 deg/s have {rms_of(full):.1f} deg/s, the "
        f"{len(RATES_DPS)} printed ones {rms_of(RATES_DPS):.1f} deg/s; Table 3 "
        f"gives {third[0]:.1f} and {third[1]:.1f} deg/s, neither.",
        "Recipe table1-x-table2 has the rates as printed, yang-23-rates has +-350 deg/s too; which this page uses.",
    )
    below = [
        f"{turning} to {output}" for turning, outputs in TABLE_3.items()
        for output, (_, _, mean, rms) in outputs.items() if rms < abs(mean)
    ]  # fmt: skip
    cells = sum(len(outputs) for outputs in TABLE_3.values())
    yield Contradiction(
        "Table 3",
        f"The RMS after compensation is below the size of its own mean in {len(below)} of {cells} cells "
        f"({', '.join(below)}), which no set of numbers can have.",
        "RMS^2 = mean^2 + SD^2 holds in every table here; the printed values may be standard deviations.",
    )
    yield Contradiction(
        "Table 4, turning about z",
        "The last three rows, "
        + ", ".join(f"{values[0]:g}" for values in TABLE_4[MEANS].values())
        + " and so on, stand under RMS but three are negative before compensation: they are means, and the stated "
        "reductions by 55.50, 75.36 and 48.33 % are those of the size of a mean.",
        "They are compared with means; mean, SD, RMS and maximum have names of their own.",
    )
    gains = [1 - TABLE_4["x"][o][2] / TABLE_4["x"][o][1] for o in ("y", "z")]
    yield Contradiction(
        "Table 4",
        f"Reductions of 2.110 and 8.130 % are printed for 0.0474 to 0.0473 and 0.0492 to 0.0488 deg/s, which are "
        f"{100 * gains[0]:.2f} and {100 * gains[1]:.2f} %.",
        "Reductions are computed from the printed errors; the paper's 26.75 % turning about x is that of its errors.",
    )
    yield Contradiction(
        "Table 3 against Table 4",
        f"After compensation output y has {TABLE_3['x']['y'][3]:g} deg/s RMS in Table 3 and {TABLE_4['x']['y'][2]:g} "
        f"in Table 4 (turning about x); before it, x has {TABLE_3['x']['x'][1]:g} and {TABLE_4['x']['x'][0]:g} deg/s.",
        "Neither is a target; temperature and data are named beside each number.",
    )


def _of_the_coefficients() -> Iterator[Contradiction]:
    unexplained = {axis: unexplained_dps(axis) for axis in "xy"}
    yield Contradiction(
        "K_g against Tables 3 and 4",
        "K and B do not explain the own-axis error: "
        + "; ".join(
            f"{axis}: {axis_unexplained:.3f} deg/s RMS remain ({low:.3f} to {high:.3f} by the rounding of K), "
            f"{TABLE_4[axis][axis][2]:g} printed after compensation"
            for axis, (axis_unexplained, low, high) in unexplained.items()
        )
        + ". The model has no nonlinearity, which the authors name as missing.",
        "The simulated unit has a soft limit of that size; criticism is asked what is missing.",
    )
    yield Contradiction(
        "K_g",
        "Signs are lost in print. Means of about -0.03, -0.04 and -0.03 deg/s in Table 3 make B negative; of Kxy and "
        "Kyx one is negative, since small rotations have opposite signs.",
        "Bx, By, Bz and Kxy are taken as negative; the sizes are compared.",
    )
    rates = rms_of((*RATES_DPS, *MISSING_RATES_DPS))
    pairs = ", ".join(
        f"{name} {abs(PROPOSED[NAMES.index(name)]) * rates:.2f} deg/s, output {name[2]} turning about {name[1]} at "
        f"{TABLE_3[name[1]][name[2]][1]:.2f}"
        for name in ("Kzy", "Kyz")
    )
    yield Contradiction(
        "Eq. of K_g",
        "Kyx multiplies the rate about y in output x: the first index is the input, against use. Table 3 "
        f"confirms it by the coefficient times the RMS of the rates: {pairs}; Kzx and Kxz are too close to tell.",
        "labctl names coefficients by output and input and converts at the border.",
    )


def _of_the_method() -> Iterator[Contradiction]:
    yield Contradiction(
        "Lagrange interpolation",
        "T(i-2), T(i-1), T(i) around T(i-1) < T < T(i) do not exist in the first interval; outside the range the "
        "variance grows by 19 within one step.",
        "The first interval takes the first three temperatures; outside the range a result is marked.",
    )
    yield Contradiction(
        "Traditional method",
        "Least squares at one temperature cannot lose to an interpolation on its own data; Table 4 has it lose in "
        "every row that shows a difference, so the data of fit and test are mixed.",
        "All methods are compared at temperatures that no fit has seen.",
    )
    most = max(PROPOSED[9:])
    yield Contradiction(
        "Earth's rate",
        f"The Earth's rate (0.0042 deg/s) is ignored; it is a tenth of the largest bias ({most:g} deg/s) and "
        "shifts a mean.",
        "It is subtracted where the latitude of the bench is known.",
    )


PAPER = Paper(
    "yang2018",
    "A novel tri-axial MEMS gyroscope calibration method over a full temperature range",
    "H. Yang, B. Zhou, L. Wang, H. Xing, R. Zhang, Sensors 2018, 18(9), 3004",
    tuple(_printed()),
    (*_of_the_tables(), *_of_the_coefficients(), *_of_the_method()),
)
