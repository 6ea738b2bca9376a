"""What a criticism says of coefficients that a version holds at known values."""

from __future__ import annotations

from labctl.fitting.models.error_model import ErrorModel


def held_sentences(model: ErrorModel) -> list[str]:
    """Return how the comparison treats the held coefficients of a version's model; nothing where none are held."""
    if not model.held.axes:
        return []
    listed = "; ".join(f"axis {axis}: {', '.join(names)}" for axis, names in model.held.axes.items())
    source = f" ({model.held.source})" if model.held.source else ""
    if model.forward().held.axes:
        said = (
            f"These coefficients are held at their values{source}, within their stated uncertainties, and are not "
            f"fitted: {listed}."
        )
    else:
        said = (
            f"The version holds these coefficients at their values{source}: {listed}. They belong to a law of the "
            "output; this comparison fits a law of the true rate, in which they are estimated."
        )
    return [said]
