"""Where and how a model fails, as numbers for pictures: one list for each view, compact enough to leave as JSON.

A view says nothing about a cause; `draws_of` names, for each view, the effects of the catalogue whose signature would
appear in it, as each effect states itself.
"""

from __future__ import annotations

from collections.abc import Mapping

from labctl.answers.views import AngleSpectrum, FrequencySpectrum, StartProfile, Views
from labctl.fitting.criticism.diagnostics.angle_spectra import angle_lines, frequency_lines, start_profile
from labctl.fitting.criticism.diagnostics.axis import AxisView, axis_view
from labctl.fitting.criticism.diagnostics.cells import residual_maps
from labctl.fitting.criticism.diagnostics.channels import channel_lines, data_sets, previous_rate, time_line
from labctl.fitting.criticism.diagnostics.periodogram import between_sets
from labctl.fitting.criticism.diagnostics.repeatability import hysteresis_lines, repeats
from labctl.fitting.criticism.diagnostics.within_dataset import within_of
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.residuals import Residuals
from labctl.fitting.effects import Effect
from labctl.recording import Recording

#: Diagnostics beside the residual against each channel, which goes by the channel's name.
VIEWS = ("map", "time", "angle", "frequency", "time_in_set", "legs", "previous_rate", "worst", "repeats")

__all__ = ["VIEWS", "draws_of", "residual_maps", "views_of"]


def views_of(
    comparison: Comparison,
    axis_residuals: Mapping[str, Residuals],
    recording: Recording,
    catalogue: Mapping[str, Effect],
) -> Views:
    """Return all views of a criticism: lists of records, one or more for each axis, of plain numbers without NaN."""
    axes = [axis_view(comparison, axis, residuals) for axis, residuals in axis_residuals.items()]
    channels = [line for view in axes for line in channel_lines(view)]
    angle, frequency, start = _within(axes, recording)
    return {
        "sets": data_sets(comparison.data, axes),
        "channels": channels,
        "time": [time_line(view) for view in axes],
        "frequency": [line for view in axes if (line := between_sets(view)) is not None],
        "legs": [line for view in axes for line in hysteresis_lines(view)],
        "previous_rate": [rate_before for view in axes if (rate_before := previous_rate(view)) is not None],
        "repeats": [again for view in axes if (again := repeats(view)) is not None],
        "angle": angle,
        "frequency_within": frequency,
        "time_in_set": start,
        "draws": draws_of(catalogue, {line["channel"] for line in channels}),
    }


def _within(
    axes: list[AxisView], recording: Recording
) -> tuple[list[AngleSpectrum], list[FrequencySpectrum], list[StartProfile]]:
    """Return what happens inside data sets: waves in the angle, waves in time, and the course from the beginning."""
    angle: list[AngleSpectrum] = []
    frequency: list[FrequencySpectrum] = []
    start: list[StartProfile] = []
    readings = within_of(recording)
    if readings is not None:
        for view in axes:
            residual = readings.axis(view.axis)
            angle += angle_lines(readings, residual, view.axis)
            frequency += frequency_lines(readings, residual, view.axis)
            start += start_profile(readings, residual, view.axis)
    return angle, frequency, start


def draws_of(catalogue: Mapping[str, Effect], channels: set[str]) -> dict[str, list[str]]:
    """Return view or channel -> ids of the effects whose signature would appear there."""
    names = (*VIEWS, *sorted(channels))
    return {name: [kind.id for kind in catalogue.values() if name in kind.draws] for name in names}
