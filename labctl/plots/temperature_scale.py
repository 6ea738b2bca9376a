"""The colour of a temperature, in every figure: blue is cold, red is hot. The pages have the same colours.

`labctl/web/static/js/core/temperature_scale.js` holds them for the pages; a test compares the two.
"""

from __future__ import annotations

from collections.abc import Sequence

from plotly.colors import sample_colorscale

#: Share of the temperature range, colour.
TEMPERATURE_SCALE = [
    [0.0, "#2f60be"],
    [0.25, "#59aab8"],
    [0.5, "#c3af65"],
    [0.75, "#cb7034"],
    [1.0, "#bd1018"],
]


def temperature_colour(temperature_c: float, low_c: float, high_c: float) -> str:
    """Return the colour of a temperature in a range, as `rgb(r,g,b)`; the middle of the scale where it has no width."""
    share = (temperature_c - low_c) / (high_c - low_c) if high_c > low_c else 0.5
    (colour,) = sample_colorscale(TEMPERATURE_SCALE, [min(max(share, 0.0), 1.0)])
    return str(colour).replace(" ", "")


def temperature_marker(
    temperature_c: Sequence[float], low_c: float, high_c: float, **more: object
) -> dict[str, object]:
    """Return a Plotly marker coloured by temperature, of a range from low_c to high_c shared by a figure's traces."""
    return {"color": list(temperature_c), "colorscale": TEMPERATURE_SCALE, "cmin": low_c, "cmax": high_c, **more}
