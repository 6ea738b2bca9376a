// The versions of a unit: the one in force on top, then the newest; earlier ones when they are asked for.

import { get } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { count, instant, number } from "../core/format.js";
import { actButton, button, cardWithHeader, chip, loadInto, modelName, table } from "../core/components.js";
import { askCertification, askRevocation, fetchTable } from "./certification.js";
import { certificateFiles } from "./certificate.js";
import { exportFiles } from "./export_files.js";

/** @import { CalibrationRow, Certificate, Certification, Unit } from "../../../types/api.js" */

/** Versions that are shown at first, and that one press shows more. */
const PART = 10;

/**
 * @param {Unit} unit
 * @param {readonly CalibrationRow[]} rows newest first
 * @param {readonly Certificate[]} issued
 * @param {readonly Certification[]} history newest first
 * @param {string} explore
 */
export function versionsCard(unit, rows, issued, history, explore) {
  const place = h("div", { class: "stack" });
  const ordered = [...rows.filter((row) => row.certified), ...rows.filter((row) => !row.certified)];
  const columns = columnsOf(unit, issued, history, explore);
  /**
   * @param {number} shown
   * @returns {void}
   */
  function show(shown) {
    setChildren(
      place,
      table(columns, ordered.slice(0, shown), { label: "Calibrations", selected: (row) => row.certified }),
      shown < ordered.length
        ? h(
            "div",
            { class: "row" },
            h("p", { class: "muted small", role: "status" }, `${shown} of ${count(ordered.length)} versions`),
            button(`Show ${Math.min(PART, ordered.length - shown)} earlier`, () => show(shown + PART)),
            button("Show all", () => show(ordered.length)),
          )
        : null,
    );
  }
  show(PART);
  return cardWithHeader("Calibrations", null, place);
}

/**
 * @param {Unit} unit
 * @param {CalibrationRow} row
 */
const act = (unit, row) =>
  row.certified
    ? actButton("Revoke", () => askRevocation(unit.serial, row.version), { kind: "tiny" })
    : actButton("Certify: put in force", () => askCertification(unit.serial, row.version), { kind: "tiny" });

/**
 * @param {Unit} unit
 * @param {readonly Certificate[]} issued
 * @param {readonly Certification[]} history
 * @param {string} explore
 * @returns {Parameters<typeof table<CalibrationRow>>[0]}
 */
const columnsOf = (unit, issued, history, explore) => [
  {
    title: "Version",
    cell: (row) =>
      h(
        "span",
        { class: "row tight" },
        h("a", { href: `${explore}&version=${row.version}` }, `${row.version}`),
        row.certified ? chip("in force", "good") : null,
        row.notices?.length ? h("span", { title: row.notices.join("; ") }, chip("standard bad", "bad")) : null,
      ),
  },
  {
    title: "Model",
    cell: (row) =>
      h(
        "span",
        {},
        modelName(row.model),
        row.parent ? h("span", { class: "muted small" }, ` from ${row.parent}`) : null,
      ),
  },
  {
    title: "Made",
    cell: (row) =>
      h(
        "div",
        { class: "nowrap" },
        instant(row.created_at),
        h("div", { class: "muted small" }, h("code", { title: `hash ${row.hash}` }, row.hash.slice(0, 10))),
      ),
  },
  { title: "RMS, deg/s", number: true, cell: (row) => number(row.rms_dps) },
  { title: "RMS at temperatures left out, deg/s", number: true, cell: (row) => number(row.heldout_rms_dps) },
  {
    title: "Action",
    acts: true,
    cell: (row) =>
      h(
        "div",
        { class: "row version-actions" },
        act(unit, row),
        certificateFiles(unit.serial, row.version, issued, history),
        h("details", {}, h("summary", {}, "Files"), exportFiles(unit, row.version)),
        fetchedBy(unit.serial, row.version),
      ),
  },
];

/**
 * Who fetched a version, read when it is opened.
 * @param {string} serial
 * @param {number} version
 */
function fetchedBy(serial, version) {
  const place = h("div");
  const ontoggle = () =>
    loadInto(place, "Reading who fetched it", async () => {
      const rows = await get("/api/units/{serial}/calibrations/{version}/fetches", { path: { serial, version } });
      return rows.length ? fetchTable(rows) : h("p", { class: "muted" }, "No fetch was recorded.");
    });
  return h("details", { ontoggle }, h("summary", {}, "Fetched by"), place);
}
