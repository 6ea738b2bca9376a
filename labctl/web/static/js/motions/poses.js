// Turns by hand between rests: gravity before and after each, by the accelerometer and by the gyro.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { number } from "../core/format.js";
import { notice, table } from "../core/components.js";

/** @import { Motion } from "../../../types/api.js" */
/** @import { Picture } from "../../../types/pages.js" */

/** @param {Motion} found */
export function poseFigures(found) {
  if (!found.poses) return null;
  const { poses } = found;
  const turn = poses.from_s.map((from, k) => `${number(from, 4)} to ${number(poses.until_s[k], 4)} s`);
  const most = Math.max(...poses.accelerometer_deg, ...poses.gyro_deg, 1);
  /** @returns {Picture} */
  const angles = () => ({
    data: [
      {
        type: "scatter",
        mode: "lines",
        name: "equal",
        x: [0, most],
        y: [0, most],
        line: { color: colour("border-strong"), dash: "dash", width: 1 },
        hoverinfo: "skip",
      },
      {
        type: "scatter",
        mode: "markers",
        name: "moves",
        x: poses.accelerometer_deg,
        y: poses.gyro_deg,
        text: turn,
        marker: { size: 8, color: axisColour("x") },
        hovertemplate: "%{text}<br>accelerometer %{x:.4g} deg, gyro %{y:.4g} deg<extra></extra>",
      },
    ],
    layout: {
      showlegend: false,
      xaxis: { title: { text: "by the accelerometer, deg" } },
      yaxis: { title: { text: "by the gyro, deg" } },
    },
  });
  /** @returns {Picture} */
  const residuals = () => ({
    data: [
      {
        type: "bar",
        name: "residual",
        x: poses.from_s.map((from, k) => (from + poses.until_s[k]) / 2),
        y: poses.residual_deg,
        text: turn,
        textposition: "none",
        marker: { color: axisColour("x") },
        hovertemplate: "%{text}<br>%{y:.3g} deg<extra></extra>",
      },
    ],
    layout: {
      showlegend: false,
      xaxis: { title: { text: "middle of the move, s" } },
      yaxis: { title: { text: "error of the direction of gravity, deg" } },
    },
  });
  const of = found.version === null ? "the uncorrected outputs, bias included" : `version ${found.version}`;
  return h(
    "div",
    { class: "stack" },
    found.left_out.length
      ? notice("", `${found.rows} of ${found.of} moves are shown. Left out: ${found.left_out.join("; ")}.`)
      : h("p", { class: "muted small" }, `All ${found.of} moves from one rest to the next are shown.`),
    h(
      "div",
      { class: "columns" },
      figure(
        "Angle of each move",
        `Change of the direction of gravity, in the axes of the unit, from one rest to the next: as measured by the accelerometer, and as computed from ${of} of the gyro. On the dashed line both are equal.`,
        angles,
        { height: "19rem" },
      ),
      figure(
        "Residual of each move",
        "Angle between two directions of gravity after each move: the direction computed from the gyro, and the direction measured by the accelerometer.",
        residuals,
        { height: "19rem" },
      ),
    ),
    table(
      [
        { title: "Move, s", cell: (k) => h("span", { class: "nowrap" }, turn[k]) },
        { title: "Accelerometer, deg", number: true, cell: (k) => number(poses.accelerometer_deg[k], 5) },
        { title: "Gyro, deg", number: true, cell: (k) => number(poses.gyro_deg[k], 5) },
        {
          title: "Difference, deg",
          number: true,
          cell: (k) => number(poses.gyro_deg[k] - poses.accelerometer_deg[k], 2),
        },
        {
          title: "Error of the direction of gravity, deg",
          number: true,
          cell: (k) => number(poses.residual_deg[k], 2),
        },
      ],
      poses.from_s.map((_, k) => k),
      { dense: true, label: "Moves" },
    ),
  );
}
