// The performance sheet of a unit: measured characteristics beside specified ones, each with its recording.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { button, cardWithHeader, chip, loadInto, table } from "../core/components.js";
import { number } from "../core/format.js";
import { query, updateQuery } from "../core/router.js";
import { unitText } from "../core/shown_unit.js";

/** @import { Characteristic, Datasheet } from "../../../types/api.js" */

/** What the address says of a sheet that is open, so that it stays so when the page is shown again. */
const OPEN = "open";

/**
 * A card whose sheet is computed on demand: it reads every recording of the unit.
 * @param {string} serial
 * @param {AbortSignal} signal
 */
export function datasheetCard(serial, signal) {
  const place = h("div", {});
  const load = () =>
    loadInto(place, "Performance sheet", async () =>
      sheet(await get("/api/units/{serial}/datasheet", { path: { serial }, signal })),
    );
  const show = button("Show the performance sheet", () => {
    updateQuery({ sheet: OPEN });
    return load();
  });
  if (query().sheet === OPEN) load();
  return Object.assign(cardWithHeader("Performance sheet", show, place), { id: "datasheet" });
}

/** @param {Datasheet} answer */
function sheet(answer) {
  return h(
    "div",
    { class: "stack" },
    answer.text.map((text) => h("p", {}, text)),
    h("p", {}, answer.basis),
    table(
      [
        {
          title: "Characteristic",
          prose: true,
          cell: (row) => [row.title, h("div", { class: "muted small" }, row.definition)],
        },
        { title: "Axis", cell: (row) => (row.along ? `${row.axis} per ${row.along}` : row.axis) },
        { title: "Measured", number: true, cell: measured },
        { title: "u", number: true, cell: (row) => number(row.u, 2) },
        { title: "Unit", cell: (row) => unitText(row.unit) },
        {
          title: "Maker's data sheet",
          cell: (row) => (row.specified === null ? "" : `${row.specified_as} ${number(row.specified)}`),
        },
        { title: "Decision", cell: decision },
        { title: "From", cell: source },
      ],
      answer.characteristics,
      { label: `Performance sheet of ${answer.serial}`, dense: true },
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
