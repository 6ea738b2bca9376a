// What the units of a type have in common: the report in sentences, what is missing, coefficients, units unlike others.

import { card, cardWithHeader, chip, table, withCommands } from "../core/components.js";
import { h } from "../core/elements.js";
import { count, idText, inWords, withUncertainty, withUnit } from "../core/format.js";
import { shownUnit } from "../core/shown_unit.js";
import { bars } from "./bars.js";

/** @import { FleetReport } from "../../../types/api.js" */

const effectLink = (/** @type {string} */ id) => h("a", { href: `/effects/${encodeURIComponent(id)}` }, idText(id));

/**
 * The ids of all effects that a report speaks of.
 * @param {FleetReport} report
 */
const effectsOf = ({ missing, figures }) => [
  ...missing.flatMap(({ effects }) => effects),
  ...Object.keys(figures.missing),
];

/** @param {FleetReport} report */
export const reportCards = (report) => [missingCard(report), saidCard(report), coefficientCard(report)];

/** @param {FleetReport} report */
function missingCard(report) {
  return card(
    "What is missing",
    h(
      "div",
      { class: "columns multiples" },
      bars(
        "Named in single units",
        Object.entries(report.figures.missing).map(([id, units]) => ({ name: idText(id), units })),
        "No single unit names an effect.",
      ),
      h(
        "div",
        { class: "stack" },
        h("h3", {}, "Named for the type"),
        report.missing.length
          ? h(
              "ul",
              { class: "stack", "aria-label": "Named for the type" },
              report.missing.map((each) =>
                h(
                  "li",
                  {},
                  each.effects.flatMap((id, k) => (k ? [" or ", effectLink(id)] : [effectLink(id)])),
                  " ",
                  chip(whose(each), "warn"),
                  h("p", { class: "muted" }, inWords(each.text, effectsOf(report))),
                ),
              ),
            )
          : h("p", { class: "muted" }, `No effect, by the criticisms of ${count(report.evidence_units)} units.`),
      ),
    ),
  );
}

/** @param {FleetReport["missing"][number]} missing */
const whose = ({ of_bench: bench, common }) =>
  bench !== null ? `bench ${bench}` : common ? "one size in all units" : "of another size in each unit";

/** @param {FleetReport} report */
const saidCard = (report) =>
  card(
    "Report",
    report.text.map((sentence) => h("p", {}, withCommands(inWords(sentence, effectsOf(report))))),
  );

/**
 * @param {number | null} value
 * @param {string} unit
 * @param {string} name of the coefficient
 * @param {number} digits
 */
function inUnit(value, unit, name, digits) {
  const [factor, shown] = shownUnit(unit, name);
  return withUnit(value === null ? null : factor * value, shown, digits);
}

/** @param {FleetReport} report */
function coefficientCard(report) {
  if (!report.coefficients.length) return null;
  return cardWithHeader(
    "Coefficients of the type",
    chip(`${count(report.compared)} units`),
    table(
      [
        { title: "Coefficient", cell: ({ name }) => name },
        {
          title: "Mean ± U (95.45 %)",
          number: true,
          cell: ({ name, mean, expanded_u_mean, unit }) => withUncertainty(mean, expanded_u_mean, unit, name),
        },
        { title: "Spread", number: true, cell: ({ name, spread, unit }) => inUnit(spread, unit, name, 3) },
        { title: "u of a unit", number: true, cell: ({ name, median_u, unit }) => inUnit(median_u, unit, name, 2) },
      ],
      report.coefficients,
      { label: "Coefficients of the type" },
    ),
    report.outliers.length
      ? table(
          [
            {
              title: "Unit",
              cell: ({ serial }) => h("a", { href: `/units/${encodeURIComponent(serial)}` }, serial),
            },
            { title: "Unlike its type", prose: true, cell: ({ text }) => text },
          ],
          report.outliers,
          { label: "Units unlike their type" },
        )
      : null,
  );
}
