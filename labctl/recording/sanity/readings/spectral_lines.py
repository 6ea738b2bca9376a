"""Lines in the spectrum of the outputs: the mains as they are sampled, and vibration."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import Array, Marked, Series, medians_of_five

#: Readings of one piece of the spectrum; data sets with fewer are left out.
MAX_READINGS, MIN_READINGS = 2048, 128
#: Bins beside a line in which the background is found, those left out, and the first bin that is examined.
BACKGROUND, GUARD, FIRST_BIN = 10, 2, 5
#: Probability of a line by chance in one spectrum; a line must also have this share of the noise of one reading.
CHANCE, MIN_SHARE = 1e-7, 0.2
#: Neighbouring pieces overlap by half, so that their number counts as this share.
INDEPENDENT = 0.7
MAINS_HZ = (50.0, 60.0, 100.0, 120.0)
#: The mains are kept to this share of their frequency.
MAINS_SHARE = 2e-3


def check_lines(series: Series) -> Iterator[Marked]:
    """Yield the outputs with a line at one frequency in all data sets; lines that follow the table's rate are none.

    A stepper's ripple follows the rate, and as it is sampled it may yet be at one frequency: at whole multiples
    of 25 deg/s, full steps of 1.8 deg are all at multiples of 125/9 Hz when sampled at 125 Hz. At rest it is not there.
    """
    pieces = _pieces(series)
    if series.rate_dps is None:  # of turns by hand only what is between them can show a line
        pieces = [same for same in pieces if all(series.still[piece].all() for piece in same)]
    if not pieces:
        return
    readings = pieces[0][0].stop - pieces[0][0].start
    limit = _limit(len(pieces), float(np.median([len(same) for same in pieces])), readings // 2)
    hz = np.asarray(np.fft.rfftfreq(readings, series.step_s), dtype=np.float64)
    window = np.hanning(readings)
    at_rest = [bool(series.still[same[0]].all()) for same in pieces]
    for name, values in series.residuals.items():
        noise = series.noises[name]
        middle = medians_of_five(values)
        smooth = middle + np.clip(values - middle, -8 * noise, 8 * noise)  # a spike is no line
        sets = [np.mean([_power(smooth[piece], window) for piece in same], axis=0) for same in pieces]
        spectrum = np.median(sets, axis=0)  # a line that follows the table's rate is in few data sets at one frequency
        over = _over_background(spectrum)
        if over.max() > limit:
            over = _seen_at_rest(over, [own for own, rests in zip(sets, at_rest, strict=True) if rests])
        k = int(np.argmax(over))
        power = float(spectrum[max(k - 1, 0) : k + 2].sum()) * 4 / float(np.sum(window**2)) / readings
        size = float(np.sqrt(power))
        if over[k] <= limit or size < MIN_SHARE * noise:
            continue
        found_hz = _peak(spectrum, hz, k)
        yield Marked(_finding(name, found_hz, size, series.step_s, len(series)), np.ones(len(series), dtype=bool))


def _seen_at_rest(over: Array, still: list[Array]) -> Array:
    """Return heights of lines over the background (k,), 0 for those that the spectra (k,) at rest do not have.

    A line is there where its height at rest is nearer to `over` than to none. In logarithms: a moving table has the
    higher background. Where no data set is at rest, each line is taken as seen.
    """
    if not still:
        return over
    height = np.pad(_over_background(np.median(still, axis=0)), 1)
    return np.where(np.maximum(np.maximum(height[:-2], height[1:-1]), height[2:]) >= np.sqrt(over), over, 0.0)


def _power(values: Array, window: Array) -> Array:
    return np.asarray(np.abs(np.fft.rfft((values - values.mean()) * window)) ** 2)


def _limit(sets: int, pieces: float, bins: int) -> float:
    """Return how far over its background noise alone takes a bin of the median over data sets, by chance in any bin.

    At least half of the data sets must be above it (a bound by Bonferroni); each is a mean over its pieces.
    """
    shape, half = max(INDEPENDENT * pieces, 1.0), (sets + 1) // 2
    chance = (CHANCE / bins / comb(sets, half)) ** (1.0 / half)
    from scipy.special import gammainccinv, gammaincinv  # noqa: PLC0415  0.2 s that only records of readings need

    return float(gammainccinv(shape, min(chance, 0.5)) / gammaincinv(shape, 0.5))


def _pieces(series: Series) -> list[list[slice]]:
    """Return pieces of one length, half overlapping, of each data set that is long enough."""
    lengths = [part.stop - part.start for part in series.parts]
    long = [length for length in lengths if length >= MIN_READINGS]
    if not long:
        return []
    readings = min(1 << int(np.log2(np.median(long))), MAX_READINGS)
    if len(series.parts) == 1 and long[0] < 8 * readings:
        readings = max(readings // 4, MIN_READINGS)
    pieces = []
    for part in series.parts:
        begins = range(part.start, part.stop - readings + 1, readings // 2)
        pieces.append([slice(begin, begin + readings) for begin in begins])
    return [same for same in pieces if same]


def _over_background(spectrum: Array) -> Array:
    """Return a spectrum (k,) over what is beside each bin; 0 in the first bins, where drift is."""
    padded = np.log(np.maximum(spectrum, 1e-300))
    excess = np.zeros(len(spectrum))
    for k in range(FIRST_BIN, len(spectrum)):
        below = padded[max(k - GUARD - BACKGROUND, 1) : k - GUARD]
        right = padded[k + GUARD + 1 : k + GUARD + 1 + BACKGROUND]
        sides = [float(np.median(side)) for side in (below, right) if len(side) >= 2]
        excess[k] = np.exp(padded[k] - max(sides))
    return excess


def _peak(spectrum: Array, hz: Array, k: int) -> float:
    """Return the frequency of a line near bin k, Hz, as the centre of its three bins."""
    near = slice(max(k - 1, 0), k + 2)
    return float(np.sum(hz[near] * spectrum[near]) / np.sum(spectrum[near]))


def mains_at(hz: float, step_s: float, tolerance_hz: float) -> float | None:
    """Return which line of the mains, Hz, is seen at a frequency when sampled every `step_s`; None for none."""
    rate_hz = 1.0 / step_s
    for mains in MAINS_HZ:
        folded_hz = abs(mains - rate_hz * round(mains / rate_hz))
        if abs(folded_hz - hz) < tolerance_hz + MAINS_SHARE * mains:
            return mains
    return None


def _finding(name: str, hz: float, size: float, step_s: float, n: int) -> Finding:
    mains = mains_at(hz, step_s, 0.01 * min(1.0, 0.1 / step_s))
    cause = (
        f"the mains ({mains:g} Hz, sampled at {1 / step_s:.4g} Hz), or a vibration"
        if mains is not None
        else "a vibration, such as of a fan or a motor"
    )
    return Finding(
        "mains" if mains is not None else "vibration", "likely", f"{name}, {hz:.4g} Hz",
        f"a line of {size:.2g} deg/s (amplitude) at {hz:.4g} Hz: {cause}",
        size, "deg/s", "a spectrum without lines",
        "earth and screen the cable, or set the unit on a still base; means over many periods are hardly affected",
        channel=name, n=n,
    )  # fmt: skip
