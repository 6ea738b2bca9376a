"""An Allan deviation as text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, table

if TYPE_CHECKING:
    from labctl.answers.noise import AllanJson, NoiseFigure
    from labctl.answers.recordings import AllanResponse

#: Averaging times closer than this share of each other stand in one row.
SAME_TIME = 1e-3


def print_allan(answers: Sequence[AllanResponse]) -> None:
    """Print deviation against averaging time, one column per axis, then the figures and what the data sheet says."""
    lines = [
        (axis if len(answers) == 1 else f"{answer.recording} {axis}", noise)
        for answer in answers
        for axis, noise in answer.axes.items()
    ]
    lengths = ", ".join(f"{answer.duration_s or 0.0:.0f} s" for answer in answers)
    rows = table(f"{lengths} at rest", "tau s", *(name for name, _ in lines), numbers=1 + len(lines))
    for tau in _times([noise for _, noise in lines]):
        rows.add_row(format_number(tau), *(_deviation(noise, tau) for _, noise in lines))
    console.print(rows)
    for name, noise in lines:
        figures = (("N", noise["N"]), ("B", noise["B"]), ("K", noise["K"]))
        text = ", ".join(f"{letter} {_shown(figure)}" for letter, figure in figures)
        console.print(f"{name}: {text}", soft_wrap=True)
        for remark in _remarks(noise):
            console.print(f"  {remark}", soft_wrap=True, style="dim")
    for answer in answers:
        of = "" if len(answers) == 1 else f" of recording {answer.recording}"
        for name, value in answer.datasheet.items():
            console.print(f"data sheet{of}: {name} = {value:g}")


def _times(noises: Sequence[AllanJson]) -> list[float]:
    """Return the averaging times of all axes, rising, those that are alike once."""
    times_s: list[float] = []
    for tau in sorted(tau for noise in noises for tau in noise["tau_s"] if tau is not None):
        if not times_s or tau > times_s[-1] * (1 + SAME_TIME):
            times_s.append(tau)
    return times_s


def _deviation(noise: AllanJson, tau: float) -> str:
    near = (k for k, tau_s in enumerate(noise["tau_s"]) if tau_s is not None and abs(tau_s - tau) <= SAME_TIME * tau)
    k = next(near, None)
    return "" if k is None else format_number(noise["deviation_dps"][k])


def _remarks(noise: AllanJson) -> Iterator[str]:
    """Yield what keeps the figures from resting on every averaging time."""
    if (from_s := noise.get("from_s")) is not None:
        yield f"N, B and K are of averaging times from {from_s:.3g} s on; shorter ones do not follow the terms"
    if (smoothing_s := noise.get("smoothing_s")) is not None:
        yield f"an output filter smooths over {smoothing_s:.2g} s; N is that of averaging times well above"
    if (step_dps := noise.get("step_dps")) is not None:
        yield f"the output has steps of {step_dps:.3g} deg/s, larger than its noise; bounds allow for half a step"


def _shown(figure: NoiseFigure) -> str:
    if figure["value"] is None:
        return "-" if figure["at_most"] is None else f"at most {figure['at_most']:.3g} {figure['unit']}"
    u = "" if figure["u"] is None else f" +- {figure['u']:.2g}"
    return f"{figure['value']:.3g}{u} {figure['unit']}"
