// The data sheet of a unit: measured characteristics beside specified ones, each with its recording.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { button, cardWithHeader, chip, loadInto, table } from "../core/components.js";
import { number } from "../core/format.js";
import { unitText } from "../core/shown_unit.js";

/** @import { Characteristic, Datasheet } from "../../../types/api.js" */

/**
 * A card whose sheet is computed on demand: it reads every recording of the unit.
 * @param {string} serial
 * @param {AbortSignal} signal
 */
export function datasheetCard(serial, signal) {
  const place = h("div", {});
  const show = button("Show the data sheet", () =>
    loadInto(place, "Data sheet", async () =>
      sheet(await get("/api/units/{serial}/datasheet", { path: { serial }, signal })),
    ),
  );
  return Object.assign(cardWithHeader("Data sheet", show, place), { id: "datasheet" });
}

/** @param {Datasheet} answer */
function sheet(answer) {
  return h(
    "div",
    { class: "stack" },
    answer.text.map((text) => h("p", {}, text)),
    table(
      [
        { title: "Characteristic", cell: (row) => row.title },
        { title: "Axis", cell: (row) => (row.along ? `${row.axis} per ${row.along}` : row.axis) },
        { title: "Measured", number: true, cell: measured },
        { title: "u", number: true, cell: (row) => number(row.u, 2) },
        { title: "Unit", cell: (row) => unitText(row.unit) },
        {
          title: "Specified",
          cell: (row) => (row.specified === null ? "" : `${row.specified_as} ${number(row.specified)}`),
        },
        { title: "Decision", cell: decision },
        { title: "From", cell: source },
      ],
      answer.characteristics,
      { label: `Data sheet of ${answer.serial}`, dense: true },
    ),
    h("p", { class: "muted small" }, answer.decision_rule),
  );
}

/** @param {Characteristic} row */
function measured(row) {
  if (row.value !== null) return number(row.value);
  return row.at_most === null ? "–" : `below ${number(row.at_most)}`;
}

/** @param {Characteristic} row */
function decision(row) {
  if (row.passed === null) return "";
  const near = row.near_limit ? ", near the limit" : "";
  return row.passed ? chip(`pass${near}`, "good") : chip(`fail${near}`, "bad");
}

/** @param {Characteristic} row */
function source(row) {
  const under = row.conditions;
  if (!under) return row.why;
  const warm = under.temperature_c;
  const at = warm ? ` ${number(warm[0])}${warm[1] - warm[0] > 0.5 ? ` to ${number(warm[1])}` : ""} °C` : "";
  const sets = under.datasets === null ? "" : `, ${under.datasets} data sets`;
  return h("span", {}, h("a", { href: `/recordings/${under.recording}` }, `recording ${under.recording}`), at, sets);
}
