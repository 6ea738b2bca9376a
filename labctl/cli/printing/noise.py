"""An Allan deviation as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, table

if TYPE_CHECKING:
    from labctl.json_types.noise import NoiseFigure
    from labctl.services.schemas.recordings import AllanResponse


def print_allan(answer: AllanResponse) -> None:
    """Print deviation against averaging time, one column per axis, then the figures and what the data sheet says."""
    first = next(iter(answer.axes.values()))
    rows = table(f"{answer.duration_s or 0.0:.0f} s at rest", "tau s", *answer.axes, numbers=1 + len(answer.axes))
    for k, tau in enumerate(first["tau_s"]):
        rows.add_row(format_number(tau), *(format_number(axis["deviation_dps"][k]) for axis in answer.axes.values()))
    console.print(rows)
    for name, axis in answer.axes.items():
        said = ", ".join(
            f"{letter} {_shown(figure)}" for letter, figure in (("N", axis["N"]), ("B", axis["B"]), ("K", axis["K"]))
        )
        console.print(f"{name}: {said}", soft_wrap=True)
    for name, value in answer.datasheet.items():
        console.print(f"data sheet: {name} = {value:g}")


def _shown(figure: NoiseFigure) -> str:
    if figure["value"] is None:
        return "-" if figure["at_most"] is None else f"at most {figure['at_most']:.3g} {figure['unit']}"
    u = "" if figure["u"] is None else f" +- {figure['u']:.2g}"
    return f"{figure['value']:.3g}{u} {figure['unit']}"
