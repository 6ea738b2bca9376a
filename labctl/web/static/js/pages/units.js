// The page of all units, by serial number.

import { get, getPart } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { count, day } from "../core/format.js";
import { chip, emptyState, pageHeader, table } from "../core/components.js";
import { longList } from "../core/long_list.js";
import { errorSparkline } from "../core/sparkline.js";
import { VERDICTS, verdictChip } from "../unit/certification.js";

/** @import { Batch, Unit } from "../../../types/api.js" */
/** @import { PageContext } from "../../../types/pages.js" */

/** @type {readonly [string, string][]} */
const CALIBRATIONS = [
  ["in_force", "in force"],
  ["overdue", "overdue"],
  ["none", "none in force"],
];

/**
 * @param {Batch} batch
 * @returns {[string, string]}
 */
const batchOption = ({ batch, units }) => [batch, `${batch} (${count(units)})`];

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const batches = await get("/api/batches", { signal });
  const list = await longList({
    what: "units",
    hint: "Serial number, model, technology, batch or supplier.",
    search: query.search,
    filters: [
      { name: "calibration", label: "Calibration", options: CALIBRATIONS, value: query.calibration },
      {
        name: "verdict",
        label: "Verdict",
        options: Object.entries(VERDICTS).map(([value, [text]]) => [value, text]),
        value: query.verdict,
      },
      ...(batches.length
        ? [{ name: "batch", label: "Batch", options: batches.map(batchOption), value: query.batch }]
        : []),
    ],
    read: (part) => getPart("/api/units", { query: part, signal }),
    draw: unitTable,
    empty: noUnits(),
  });
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Units",
      "Gyros by serial number, and which calibration of each is in force.",
      h("a", { class: "button act", href: "/recordings" }, "Import a recording"),
    ),
    h("section", { class: "card", "aria-label": "Units" }, list.element),
  );
}

/** @param {readonly Unit[]} units */
const unitTable = (units) =>
  table(
    [
      {
        title: "Serial number",
        cell: (unit) => h("a", { href: `/units/${encodeURIComponent(unit.serial)}` }, unit.serial),
      },
      {
        title: "Type",
        cell: (unit) => [
          unit.model,
          unit.technology ? h("div", { class: "muted small" }, unit.technology.toUpperCase()) : null,
        ],
      },
      units.some((unit) => unit.batch)
        ? { title: "Batch", cell: (unit) => h("span", { class: "nowrap" }, unit.batch || "–") }
        : null,
      { title: "Recordings", number: true, cell: (unit) => unit.recordings.length },
      { title: "Versions", number: true, cell: (unit) => unit.calibrations.length },
      { title: "Error / noise floor", cell: (unit) => errorSparkline(unit.newest_errors) },
      {
        title: "In force",
        cell: (unit) =>
          unit.certified_version ? chip(`version ${unit.certified_version}`, "good") : chip("none", "warn"),
      },
      {
        title: "Verdict when certified",
        cell: (unit) => (unit.certified_version ? verdictChip({ verdict: unit.certified_verdict }) : "–"),
      },
      {
        title: "Due",
        cell: (unit) => (unit.overdue ? chip(`overdue since ${day(unit.due)}`, "bad") : unit.due ? day(unit.due) : "–"),
      },
      {
        title: "Action",
        cell: (unit) =>
          h("a", { class: "button tiny", href: `/explore?unit=${encodeURIComponent(unit.serial)}` }, "Explore"),
      },
    ],
    units,
    { label: "Units", first: "8rem" },
  );

const noUnits = () =>
  emptyState(
    h("p", {}, "No unit has been measured or imported yet."),
    h("p", {}, h("a", { class: "button primary", href: "/start" }, "Begin")),
  );
