// A rate that changes: table and output over time, what a version leaves, and its delay and bandwidth.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { withUncertainty } from "../core/format.js";
import { factList } from "../core/components.js";
import { ofAxis, shownOf } from "./rows.js";

/** @import { Motion } from "../../../types/api.js" */
/** @import { Picture, PlotTrace } from "../../../types/pages.js" */

/**
 * @param {Motion} found
 * @param {string} axis
 */
export function profileFigures(found, axis) {
  if (!found.profile) return null;
  const rows = ofAxis(found.profile, axis);
  const followed = rows.followed_dps.some((value) => value !== null);
  /**
   * @param {string} name
   * @param {readonly (number | null)[]} y
   * @param {string} shade
   * @param {object} [more]
   * @returns {PlotTrace}
   */
  const line = (name, y, shade, more) => ({
    type: "scattergl",
    mode: "lines",
    name,
    x: rows.t_s,
    y,
    line: { color: shade, width: 1.2 },
    hovertemplate: `${name}<br>%{x:.5g} s: %{y:.4g} deg/s<extra></extra>`,
    ...more,
  });
  const layout = (/** @type {string} */ title) => ({
    xaxis: { title: { text: "time, s" } },
    yaxis: { title: { text: title } },
  });
  /** @returns {Picture} */
  const rates = () => ({
    data: [line("table", rows.true_dps, colour("text")), line("output", rows.output_dps, axisColour(axis))],
    layout: layout("rate, deg/s"),
  });
  /** @returns {Picture} */
  const left = () => ({
    data: [
      line("as a consumer has it", rows.residual_dps, axisColour(axis)),
      ...(followed ? [line("true rate filtered by delay and bandwidth", rows.followed_dps, colour("text"))] : []),
    ],
    layout: layout("residual, deg/s"),
  });
  const shown = shownOf(found, "windows of readings");
  return h(
    "div",
    { class: "stack" },
    responseFacts(found, axis),
    figure(
      "Rate over time",
      `Axis ${axis}: rate of the table along this axis, and output of the gyro.${shown}`,
      rates,
      {
        height: "19rem",
      },
    ),
    found.version === null
      ? null
      : figure(
          "Residual over time",
          `Axis ${axis}: corrected rate minus rate of the table.${
            followed
              ? " Delay and bandwidth are not exported, since a delayed reading cannot be corrected by itself. The second line is the corrected rate minus the rate of the table filtered by delay and bandwidth."
              : ""
          }${shown}`,
          left,
          { height: "19rem" },
        ),
  );
}

/**
 * @param {Motion} found
 * @param {string} axis
 */
function responseFacts(found, axis) {
  const has = found.responses[axis];
  if (!has) return null;
  /**
   * @param {number | null} value
   * @param {number | null} expanded
   * @param {number} factor
   * @param {string} unit
   */
  const text = (value, expanded, factor, unit) =>
    value === null
      ? "not in the model"
      : withUncertainty(factor * value, expanded === null ? null : factor * expanded, unit);
  return factList([
    ["Delay, 95 %", text(has.delay_s, has.expanded_delay_s, 1e3, "ms")],
    ["Bandwidth, 95 %", text(has.bandwidth_hz, has.expanded_bandwidth_hz, 1, "Hz"), null, "at half of the power"],
  ]);
}
