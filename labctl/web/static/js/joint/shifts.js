// By how much each power-on, day or mounting is off the common coefficient, with its uncertainty.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { shownUnit } from "../core/shown_unit.js";

/** @import { Joint } from "../../../types/api.js" */
/** @import { PlotTrace } from "../../../types/pages.js" */

/** Coverage factor of the bars. */
const K = 2;

/**
 * A figure for each kind of shift: a point for each recording (run, mounting) and axis.
 * @param {Joint} joint
 */
export function shiftFigures(joint) {
  const all = Object.entries(joint.repeatability).flatMap(([axis, each]) => each.map((one) => ({ axis, ...one })));
  const terms = [...new Set(all.map((one) => one.term))];
  return h(
    "div",
    { class: "columns", style: "--column-min: 20rem" },
    terms.map((term) => {
      const kinds = all.filter((one) => one.term === term);
      const [factor, unit] = shownUnit(kinds[0].unit, term);
      /** @returns {{ data: PlotTrace[], layout: object }} */
      const draw = () => ({
        data: kinds.map(({ axis, shifts }) => ({
          type: "scatter",
          mode: "markers",
          name: `axis ${axis}`,
          x: shifts.map(({ recording, along, number }) =>
            along ? `recording ${recording}, ${along} (${number})` : `recording ${recording}`,
          ),
          y: shifts.map(({ value }) => factor * value),
          error_y: { type: "data", array: shifts.map(({ u }) => K * factor * u), thickness: 1, width: 3 },
          marker: { size: 8, color: axisColour(axis) },
          hovertemplate: `%{x}: %{y:.4g} ${unit}<extra>axis ${axis}</extra>`,
        })),
        layout: {
          xaxis: { type: "category" },
          yaxis: {
            title: { text: `off the common value, ${unit}` },
            zeroline: true,
            zerolinecolor: colour("text-muted"),
          },
          showlegend: kinds.length > 1,
        },
      });
      return h(
        "div",
        {},
        h("h3", {}, term),
        figure(
          `Shifts: ${term}`,
          `Each ${kinds[0].kind === "turn_on" ? "power-on" : kinds[0].kind === "mounting" ? "mounting" : "recording"} minus the value common to all; bars are expanded uncertainties, k = 2, which include that of the common value.`,
          draw,
          { height: "16rem" },
        ),
      );
    }),
  );
}
