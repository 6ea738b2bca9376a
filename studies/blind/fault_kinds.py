"""The kinds of faults, and what labctl may call each; without a name only a refusal that names the rows is right."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from studies.blind import faults_of_clocks, faults_of_outputs, faults_of_parts
from studies.blind.records import Record

Maker = Callable[[np.random.Generator], Record]

KINDS: dict[str, tuple[Maker, frozenset[str]]] = {
    "frozen": (faults_of_outputs.frozen, frozenset({"frozen"})),
    "frozen_set": (faults_of_outputs.frozen_set, frozenset({"frozen"})),
    "clipped": (faults_of_outputs.clipped, frozenset({"clipped"})),
    "clipped_noise": (faults_of_outputs.clipped_noise, frozenset({"clipped"})),
    "moved": (faults_of_outputs.moved, frozenset({"moved", "moves_at_rest"})),
    "nudged": (faults_of_outputs.nudged, frozenset({"moved", "moves_at_rest"})),
    "spikes": (faults_of_outputs.spikes, frozenset({"spikes"})),
    "garbage": (faults_of_outputs.garbage, frozenset({"garbage", "spikes"})),
    "dead_thermometer": (faults_of_clocks.dead_thermometer, frozenset({"thermometer"})),
    "zero_thermometer": (faults_of_clocks.zero_thermometer, frozenset({"thermometer"})),
    "power_on_85": (faults_of_clocks.power_on_85, frozenset({"thermometer"})),
    "stuck_thermometer": (faults_of_clocks.stuck_thermometer, frozenset({"thermometer"})),
    "fahrenheit": (faults_of_clocks.fahrenheit, frozenset({"fahrenheit", "mixed_units", "thermometer"})),
    "quantised": (faults_of_outputs.quantised, frozenset({"quantised"})),
    "dropped": (faults_of_clocks.dropped, frozenset({"gaps"})),
    "gap": (faults_of_clocks.gap, frozenset({"gaps"})),
    "repeated_rows": (faults_of_clocks.repeated_rows, frozenset({"repeated", "time_back"})),
    "repeated_values": (faults_of_clocks.repeated_values, frozenset({"repeated"})),
    "mixed_units": (faults_of_parts.mixed_units, frozenset({"mixed_units"})),
    "copied": (faults_of_parts.copied, frozenset({"copied"})),
    "mains": (faults_of_outputs.mains, frozenset({"mains", "vibration"})),
    "vibration": (faults_of_outputs.vibration, frozenset({"mains", "vibration"})),
    "time_back": (faults_of_clocks.time_back, frozenset({"clock_step", "time_back"})),
    "restarted": (faults_of_clocks.restarted, frozenset({"clock_step", "time_back"})),
    "swapped_lines": (faults_of_clocks.swapped_lines, frozenset({"time_back"})),
    "clock_step": (faults_of_clocks.clock_step, frozenset({"clock_step", "gaps"})),
    "clock_step_back": (faults_of_clocks.clock_step_back, frozenset({"clock_step", "time_back"})),
    "counter_overflow": (faults_of_clocks.counter_overflow, frozenset({"clock_step", "time_back"})),
    "time_unit_changed": (faults_of_clocks.time_unit_changed, frozenset({"clock_step", "time_unit"})),
    "rate_changed": (faults_of_clocks.rate_changed, frozenset({"sampling_rate"})),
    "axes_swapped": (faults_of_parts.axes_swapped, frozenset({"axes_swapped", "crossed", "two_devices"})),
    "sign_flipped": (faults_of_parts.sign_flipped, frozenset({"sign"})),
    "wrapped": (faults_of_parts.wrapped, frozenset({"wrapped"})),
    "filter_switched": (faults_of_parts.filter_switched, frozenset({"noise_changes"})),
    "range_switched": (
        faults_of_parts.range_switched,
        frozenset({"gain_changes", "mixed_units", "scale", "two_devices"}),
    ),
    "interleaved": (faults_of_parts.interleaved, frozenset({"two_devices"})),
    "bias_jump": (faults_of_parts.bias_jump, frozenset({"level_step", "rate_changes", "two_devices"})),
    "dead_axis": (faults_of_parts.dead_axis, frozenset({"dead", "frozen", "no_response"})),
    "zeros": (faults_of_parts.zeros, frozenset({"frozen"})),
    "noise_burst": (faults_of_parts.noise_burst, frozenset({"noise_changes"})),
    "lost_point": (faults_of_parts.lost_point, frozenset({"spikes"})),
    "shifted_columns": (faults_of_parts.shifted_columns, frozenset({"shifted", "two_devices"})),
    "stalled": (faults_of_parts.stalled, frozenset({"one_data_set", "rate_changes"})),
    "wrong_rate": (faults_of_parts.wrong_rate, frozenset({"one_data_set", "scale", "sign"})),
    "batched_stamps": (faults_of_clocks.batched_stamps, frozenset({"batched", "clock_step", "repeated", "time_unit"})),
    "blank_cells": (faults_of_parts.blank_cells, frozenset()),
}
