// One type of units as three small pictures: error over noise floor, verdicts, due dates.

import { card } from "../core/components.js";
import { h } from "../core/elements.js";
import { count, plainNumber } from "../core/format.js";
import { VERDICTS } from "../unit/certification.js";
import { bars } from "./bars.js";

/** @import { FleetType } from "../../../types/api.js" */
/** @import { Bar } from "./bars.js" */

/** @param {FleetType} type */
export const typeName = (type) => type.type || "not stated";

/**
 * The classes from the first to the last that has units.
 * @param {FleetType} figures
 * @returns {Bar[]}
 */
export function errorBars({ error_over_floor: classes }) {
  const last = classes.findLastIndex(({ units }) => units > 0);
  return classes.slice(0, last + 1).map(({ low, high, units }) => ({
    name: high === null ? `from ${plainNumber(low)}` : `${plainNumber(low)} to ${plainNumber(high)}`,
    units,
    kind: low >= 2 ? "bad" : low >= 1.25 ? "warn" : "good",
  }));
}

/**
 * @param {FleetType} figures
 * @returns {Bar[]}
 */
export const verdictBars = ({ verdicts }) =>
  Object.entries(VERDICTS)
    .filter(([verdict]) => verdicts[verdict])
    .map(([verdict, [text, kind]]) => ({
      name: text,
      units: verdicts[verdict],
      kind: kind === "good" || kind === "warn" || kind === "bad" ? kind : "",
    }));

/**
 * @param {FleetType} figures
 * @returns {Bar[]}
 */
export function dueBars({ due }) {
  /** @type {Bar[]} */
  const all = [
    { name: "overdue", units: due.overdue, kind: "bad" },
    { name: "within 30 days", units: due.within_30_days, kind: "warn" },
    { name: "within 90 days", units: due.within_90_days },
    { name: "later", units: due.later, kind: "good" },
    { name: "no date", units: due.no_date },
    { name: "none in force", units: due.none_in_force },
  ];
  return all.filter(({ units }) => units > 0);
}

/**
 * The command that makes what a type lacks; units are criticised once they are fitted.
 * @param {string} type
 * @param {boolean} toFit
 */
export const nextCommand = (type, toFit) =>
  ["labctl fleet", toFit ? "fit --model NAME" : "criticise", type ? `--type '${type.replaceAll("'", "'\\''")}'` : ""]
    .filter(Boolean)
    .join(" ");

/**
 * @param {FleetType} figures
 * @param {boolean} linked whether the name leads to the page of the type
 */
export function typeCard(figures, linked) {
  const name = typeName(figures);
  const [errors, verdicts] = [errorBars(figures), verdictBars(figures)];
  const missing = [errors.length ? "" : "fitted", verdicts.length ? "" : "criticised"].filter(Boolean).join(" or ");
  return card(
    `${name}: ${count(figures.units)} ${figures.units === 1 ? "unit" : "units"}`,
    h(
      "div",
      { class: "columns multiples" },
      errors.length ? bars("Error over noise floor", errors, "") : null,
      verdicts.length ? bars("Verdict", verdicts, "") : null,
      bars("Due", dueBars(figures), "No unit."),
    ),
    missing
      ? h(
          "p",
          { class: "muted small" },
          `No fleet job has ${missing} any of these units; versions that were fitted one by one do not count here. Next: `,
          h("code", {}, nextCommand(figures.type, !errors.length)),
        )
      : null,
    linked
      ? h("p", {}, h("a", { class: "button", href: `/fleet?type=${encodeURIComponent(figures.type)}` }, `Open ${name}`))
      : null,
  );
}
