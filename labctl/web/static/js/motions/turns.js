// Turns by known angles: each turn's integral against what was asked, with its uncertainty, for each output axis.

import { h } from "../core/elements.js";
import { axisColour, figure } from "../core/figure.js";
import { mean, number, withUncertainty } from "../core/format.js";
import { table } from "../core/components.js";
import { lessThan, ofAxis } from "./rows.js";

/** @import { Motion, TurnColumns } from "../../../types/api.js" */
/** @import { Picture } from "../../../types/pages.js" */

const K = 2;

/** @param {Motion} found */
export function turnFigures(found) {
  if (!found.turns) return null;
  const { turns } = found;
  const axes = [...new Set(turns.axis)];
  const corrected = found.version !== null;
  /** @returns {Picture} */
  const draw = () => ({
    data: axes.map((axis) => {
      const rows = ofAxis(turns, axis);
      return {
        type: "scatter",
        mode: "markers",
        name: `output ${axis}`,
        x: rows.dataset.map((set, k) => `${set}: about ${rows.about[k]}`),
        y: offBy(rows, corrected),
        error_y: { type: "data", array: rows.u_deg.map((u) => (u === null ? 0 : K * u)), thickness: 1, width: 4 },
        marker: { size: 9, color: axisColour(axis) },
        hovertemplate: "%{x}: %{y:.4g} deg<extra>%{fullData.name}</extra>",
      };
    }),
    layout: {
      scattermode: "group",
      xaxis: { type: "category", title: { text: "data set and axis that points up" } },
      yaxis: { title: { text: `${corrected ? "corrected" : "output"} minus true angle, deg` }, zeroline: true },
      showlegend: true,
    },
  });
  return h(
    "div",
    { class: "stack" },
    figure(
      "Measured minus true angle of each turn",
      `The integral of ${corrected ? "the corrected rate" : "the uncorrected output, bias included"} over each turn, minus the angle that this output axis turned by. Bars: expanded uncertainty U (k = 2) due to angle, time stamps and noise.`,
      draw,
      { height: "20rem" },
    ),
    turnTable(turns, corrected),
  );
}

/**
 * @param {TurnColumns} rows
 * @param {boolean} corrected
 */
export const offBy = (rows, corrected) => (corrected ? rows.residual_deg : lessThan(rows.output_deg, rows.asked_deg));

/**
 * @param {TurnColumns} turns
 * @param {boolean} corrected
 */
function turnTable(turns, corrected) {
  const off = offBy(turns, corrected);
  return table(
    [
      { title: "Data set", number: true, cell: (k) => `${turns.dataset[k]}` },
      { title: "Turned about", cell: (k) => turns.about[k] },
      { title: "Output axis", cell: (k) => turns.axis[k] },
      { title: "Asked, deg", number: true, cell: (k) => number(turns.asked_deg[k], 6) },
      { title: "Output, deg", number: true, cell: (k) => mean(turns.output_deg[k], turns.u_deg[k]) },
      corrected
        ? { title: "Corrected, deg", number: true, cell: (k) => mean(turns.corrected_deg[k], turns.u_deg[k]) }
        : null,
      {
        title: "Difference, k = 2",
        number: true,
        cell: (k) => {
          const u = turns.u_deg[k];
          return withUncertainty(off[k], u === null ? null : K * u, "deg").replace(/^-(?=[0.]+ )/, "");
        },
      },
    ],
    turns.axis.map((_, k) => k),
    { dense: true, label: "Turns" },
  );
}
