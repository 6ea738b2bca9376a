"""Ojeda, Chung, Borenstein 2000: a fibre-optic gyro with one axis, KVH E-Core RD2100."""

from __future__ import annotations

from labctl.papers.paper import Contradiction, Paper, Printed

#: Rates of Fig. 4, deg/s; each with both signs.
FIGURE_4_RATES_DPS = (60.0, 75.0, 90.0)
#: Eq. 1: readings, and seconds, of a static bias.
STATIC_READINGS, STATIC_S = 100, 10.0

#: Middle of the temperatures of the paper, deg C.
MIDDLE_C = 35.0

_PRINTED = (
    Printed("sheet_range", "Table I", "input rate, plus and minus", "deg/s", 100.0),
    Printed("sheet_resolution", "Table I", "resolution", "deg/s", 0.004),
    Printed("sheet_bit", "Table I", "scale per bit (printed in deg/s)", "deg", 0.000305),
    Printed("sheet_nonlinearity", "Table I", "nonlinearity, RMS, of full scale", "%", 0.5),
    Printed("sheet_scale_warm", "Table I", "scale factor over temperature, peak to peak", "%", 2.0),
    Printed("sheet_stability", "Table I", "bias stability at constant temperature, 1 sigma", "deg/s", 0.002),
    Printed("sheet_bias_warm", "Table I", "bias over temperature, peak to peak", "deg/s", 0.2),
    Printed("sheet_repeatability", "Table I", "bias repeatability, peak to peak", "deg/s", 0.002),
    Printed("arw_rate", "Table I", "angle random walk", "(deg/h)/sqrt(Hz)", 5.0),
    Printed("arw_angle", "Table I", "the same angle random walk", "deg/sqrt(h)", 0.08),
    Printed("sheet_bandwidth", "Table I", "bandwidth", "Hz", 100.0),
    Printed("readings", "Eq. 1", "readings of a static bias", "1", float(STATIC_READINGS)),
    Printed("bias_before", "Eq. 1", "static bias, mean of the output at rest", "deg/s", None),
    Printed("bias_after", "Eq. 15", "static bias after calibration", "deg/s", None),
    Printed("u_bias", "Eq. 1", "standard uncertainty of a static bias by white noise", "deg/s", None),
    Printed("coefficients", "Eqs. 9 to 11", "coefficients of the surface", "1", 12.0),
    Printed("raw_max", "Figs. 3, 5", "largest error before compensation", "deg/s", 2.0, "about"),
    Printed("left_max", "Fig. 7", "largest error after compensation", "deg/s", None),
    Printed("ratio", "Fig. 7", "RMS error before divided by RMS error after compensation", "1", 10.0, "about"),
    Printed("heldout_ratio", "Fig. 7", "the same, at temperatures left out of the fit", "1", None),
    Printed(
        "turn_before", "Fig. 8", "largest error per turn of 360 deg, only static bias subtracted", "deg", 15.0, "about"
    ),
    Printed("turn_after", "Fig. 9", "largest error per turn, full compensation", "deg", None),
    Printed("turn_after_share", "Fig. 9", "largest error per turn, share of the turn", "%", 2.0, "below"),
    Printed("turn_ratio", "Figs. 8, 9", "RMS error per turn before divided by after compensation", "1", 10.0, "about"),
    Printed(
        "turn_max_ratio",
        "Figs. 8, 9",
        "largest error per turn before divided by after compensation",
        "1",
        10.0,
        "about",
    ),
)

_CONTRADICTIONS = (
    Contradiction(
        "Table I",
        "The scale is printed as 0.000305 deg/s per bit, but a resolution of 0.004 deg/s; 10 bits per second of "
        "0.000305 deg are 0.00305 deg/s.",
        "A bit is taken as an angle of 0.000305 deg; its rate at 10 readings per second is the resolution.",
    ),
    Contradiction(
        "Eqs. 7 to 11",
        "p and q are the orders 3 and 2, and then the numbers of rates and temperatures, 11 and 11; every 10 deg/s "
        "over +-100 deg/s are 21 rates, and 11 x 11 = 121 means are those of every 20 deg/s.",
        "Recipe ojeda2000 has 21 rates, ojeda2000-121 has 11; orders and counts have names of their own.",
    ),
    Contradiction(
        "Figs. 4 to 9",
        "The text says 25 to 45 deg C, Fig. 4 shows 32.5 to 45, Figs. 5 to 9 show 35 to 41; there was no chamber.",
        "The measured temperature of each data set is used, and the range of each figure is that of the recording.",
    ),
    Contradiction(
        "Eq. 14",
        "Error x sampling rate x time has the unit deg/s x Hz x s: it is an angle only for an error per sample.",
        "Error per turn = error in deg/s x 360 / |rate|.",
    ),
    Contradiction(
        "Eq. 14, Figs. 8, 9",
        "The error per turn grows without bound towards rest.",
        "labctl gives the error per turn for rates of 5 deg/s or more, as the paper does, and beside it the "
        "error in deg/s.",
    ),
    Contradiction(
        "Results",
        "The paper states an error in deg/s that is one order of magnitude smaller, and an error of less than 2 "
        "% of a turn; but the uncorrected error is 2 deg/s at 100 deg/s, which is also 2 %.",
        "Both are given: the ratio of the RMS errors, and the largest error per turn as a share of 360 deg.",
    ),
    Contradiction(
        "Eq. 10",
        "The raw Vandermonde matrix of the 11 x 11 points has a condition number of some 10^10, its normal equations "
        "of some 10^21, beyond double precision.",
        "Rate and temperature are scaled and the fit is by QR; C is given in the paper's own powers.",
    ),
    Contradiction(
        "Eqs. 2, 13, 15, 16",
        "Minus signs are lost in print.",
        "Corrected rate = output - error.",
    ),
    Contradiction(
        "Results",
        "Nothing was measured twice, so repeatability is unknown.",
        "The noise floor comes from repeats where the recording has them.",
    ),
)  # fmt: skip

PAPER = Paper(
    "ojeda2000",
    "Precision-calibration of fiber-optics gyroscopes for mobile robot navigation",
    "L. Ojeda, H. Chung, J. Borenstein, Proc. IEEE ICRA 2000, pp. 2064-2069",
    _PRINTED,
    _CONTRADICTIONS,
)
