// The budget of an uncertainty: its lines at one place, and a picture of the contributions.

import { h } from "../core/elements.js";
import { chip, notice, table } from "../core/components.js";
import { colour, figure } from "../core/figure.js";
import { isNumber, number, plainNumber } from "../core/format.js";
import { contributionRows, contributionTraces } from "./contribution_lines.js";

/** @import { BudgetLine, ContributionsOver, Uncertainty } from "../../../types/api.js" */
/** @import { PlotTrace } from "../../../types/pages.js" */

/** A phone; and there, the height of a line of a legend. */
const [NARROW_PX, LEGEND_LINE_PX] = [760, 20];

/**
 * The lines of each axis, and which standards are not in them.
 * @param {Uncertainty} answer
 */
export function budgetLines(answer) {
  const several = Object.keys(answer.budget).length > 1;
  return h(
    "div",
    { class: "stack" },
    answer.not_stated.length
      ? notice(
          "warn",
          h("strong", {}, "Not stated, and not in U: "),
          `${answer.not_stated.join(", ")}. ${answer.not_stated_remedy}`,
        )
      : null,
    Object.entries(answer.budget).map(([axis, budget]) =>
      h(
        "details",
        {},
        h("summary", {}, several ? `Budget of axis ${axis}, line by line` : "Budget, line by line"),
        table(
          [
            { title: "Source", cell: nameOf },
            { title: "Type", cell: (line) => line.type },
            { title: "Distribution", cell: (line) => line.distribution },
            { title: "u", number: true, cell: (line) => (line.u === null ? "" : `${number(line.u, 3)} ${line.unit}`) },
            { title: "c", number: true, cell: (line) => number(line.sensitivity, 3) },
            { title: "|c| u, deg/s", number: true, cell: contributionOf },
            {
              title: "Degrees of freedom",
              number: true,
              cell: (line) => (line.degrees_of_freedom === null ? "∞" : number(line.degrees_of_freedom, 3)),
            },
            { title: "Note", prose: true, cell: (line) => line.why },
          ],
          [...budget.lines],
          { dense: true, label: `Budget of axis ${axis}` },
        ),
        h(
          "p",
          { class: "muted small" },
          budget.expanded === null
            ? "U is unknown."
            : `u = ${number(budget.combined, 2)} deg/s, effective degrees of freedom ${budget.effective_degrees_of_freedom === null ? "∞" : number(budget.effective_degrees_of_freedom, 3)}, k = ${number(budget.k, 3)}, U = ${number(budget.expanded, 2)} deg/s.`,
        ),
      ),
    ),
  );
}

/** The line of the model as calibration files name it, and as all pages do. */
const [HELD_OUT, LEFT_OUT] = ["held-out data sets", "data sets left out of the fit"];

/** @param {BudgetLine} line */
function nameOf(line) {
  const name = ["coefficients", "model", "repeatability"].includes(line.source)
    ? `${line.source} (${line.name === HELD_OUT ? LEFT_OUT : line.name})`
    : line.name;
  return line.overdue ? [name, " ", chip(`overdue since ${line.due}`, "bad")] : name;
}

/** @param {BudgetLine} line */
function contributionOf(line) {
  if (!line.stated) return h("span", { class: "warn-text" }, "not stated");
  return line.contribution === null ? h("span", { class: "warn-text" }, "unknown") : number(line.contribution, 2);
}

/**
 * Two figures for each axis: contributions over the rate, and over the temperature.
 * @param {{ readonly [axis: string]: ContributionsOver }} contributions
 */
export function contributionFigures(contributions) {
  return h(
    "div",
    { class: "columns", style: "--column-min: 27rem" },
    Object.entries(contributions).flatMap(([axis, over]) => [
      one(
        `Contributions, axis ${axis}, over rate`,
        over.over_rate,
        "rate, deg/s",
        `Axis ${axis}, at ${plainNumber(over.temperature_c, 3)} °C`,
      ),
      one(
        `Contributions, axis ${axis}, over temperature`,
        over.over_temperature,
        "temperature, °C",
        `Axis ${axis}, at ${plainNumber(over.rate_dps)} deg/s`,
      ),
    ]),
  );
}

/**
 * @param {string} name
 * @param {ContributionsOver["over_rate"]} lines
 * @param {string} along
 * @param {string} at
 */
function one(name, lines, along, at) {
  /** @returns {{ data: PlotTrace[], layout: object }} */
  const draw = () => {
    const data = contributionTraces(lines, colour("text"));
    const isNarrow = innerWidth < NARROW_PX; // its legend has one name a line, and they need their own room
    const below = isNarrow ? LEGEND_LINE_PX * data.length : 74;
    return {
      data,
      layout: {
        xaxis: { title: { text: along } },
        yaxis: { title: { text: isNarrow ? "u, deg/s" : "standard uncertainty, deg/s" }, rangemode: "tozero" },
        showlegend: true,
        legend: { orientation: isNarrow ? "v" : "h", yref: "container", y: 0, yanchor: "bottom", x: 0 },
        margin: { l: 58, r: 16, t: 12, b: 56 + below },
      },
    };
  };
  return figure(
    name,
    `${at}: the largest standard uncertainties of the budget, the others together (root of the sum of their squares). ${lines.expanded.some(isNumber) ? "Dashed: the expanded uncertainty U" : "U is not known"}. Uncertainties that are not stated have no line.`,
    draw,
    { height: innerWidth < NARROW_PX ? "26rem" : "21rem", csv: () => contributionRows(lines, along) },
  );
}
