// U of a campaign that ends when it is small enough: how it falls with each data set, and the target.

import { colour, figure } from "../core/figure.js";
import { h } from "../core/elements.js";
import { plainNumber } from "../core/format.js";
import { axisOf, pointsOf } from "./uncertainty_numbers.js";

/** @import { TargetUnit, UncertaintyCourse } from "../../../types/api.js" */

const SHADES = ["axis-x", "axis-y", "axis-z"];
/** @type {["of the fit" | "at least", string][]} */
const KINDS = [
  ["at least", "at least"],
  ["of the fit", "U"],
];

/**
 * @param {UncertaintyCourse} answer
 * @param {TargetUnit[]} units the newest evaluation of each
 */
export function uncertaintyCard(answer, units) {
  const target = answer.target_u_dps;
  if (target === null || !units.length) return null;
  const [none, all] = axisOf(answer);
  const several = Object.keys(answer.units).length > 1;
  const draw = () => ({
    data: [
      ...Object.entries(answer.units).flatMap(([gyro, course], k) =>
        KINDS.map(([known, text]) => ({
          type: "scatter",
          mode: "lines+markers",
          name: several ? `${gyro}: ${text}` : text,
          ...pointsOf(course, known),
          line: { color: colour(SHADES[k % SHADES.length]), width: 1.6, dash: known === "at least" ? "dot" : "solid" },
          marker: { size: 5 },
          hovertemplate: `%{y:.3g} deg/s after %{x} data sets<extra>${gyro}</extra>`,
        })),
      ),
      {
        type: "scatter",
        mode: "lines",
        name: "target",
        x: [none, all],
        y: [target, target],
        line: { color: colour("text"), width: 1.2, dash: "dash" },
        hovertemplate: `target %{y} deg/s<extra></extra>`,
      },
    ],
    layout: {
      margin: { l: 62, r: 12, t: 34, b: 42 },
      xaxis: { title: { text: "data sets" }, range: [none, all] },
      yaxis: { title: { text: "U, deg/s" }, type: "log" },
    },
  });
  const caption =
    `Largest U (95 %) of a corrected rate over the range of the recipe, and the target ${plainNumber(target)} deg/s. ` +
    "Dotted: a lower bound by the noise of the readings, while it is above the target or a part of the range is not measured.";
  return h(
    "section",
    { class: "card stack", "aria-label": "Uncertainty" },
    h("h2", {}, "Uncertainty"),
    h(
      "div",
      { "aria-live": "polite" },
      units.map((unit) => h("p", { class: "small" }, unit.text)),
    ),
    figure("U against the number of data sets", caption, draw, { height: "17rem" }),
  );
}
