// CSV files of figures.

/** @import { CsvRows, PlotTrace } from "../../../types/pages.js" */

/**
 * A name as that of a file: "Error over rate" -> "error-over-rate".
 * @param {string} name
 */
export const fileName = (name) =>
  name
    .toLowerCase()
    .replaceAll(/[^a-z0-9]+/g, "-")
    .replaceAll(/^-|-$/g, "");

/** @param {unknown} cell */
const cellText = (cell) =>
  /[",\n]/.test(String(cell)) ? `"${String(cell).replaceAll('"', '""')}"` : String(cell ?? "");

/**
 * Rows as CSV; cells with commas, quotes and line ends are quoted, null and undefined are empty.
 * @param {CsvRows} rows
 */
export const csvText = (rows) => rows.map((row) => row.map(cellText).join(",")).join("\n") + "\n";

/**
 * The numbers of Plotly traces as rows.
 * @param {readonly PlotTrace[]} traces
 */
export function traceRows(traces) {
  /** @type {unknown[][]} */
  const rows = [["trace", "x", "y", "z"]];
  for (const { name = "", x, y, z } of traces) {
    const depth = z && Array.from(z);
    if (depth && !isList(depth[0])) {
      depth.forEach((value, k) => rows.push([name, x?.[k], y?.[k], value])); // dots or a line in space
    } else if (depth) {
      depth.forEach((line, r) =>
        Array.from(isList(line) ? line : []).forEach((value, c) => rows.push([name, x?.[c] ?? c, y?.[r] ?? r, value])),
      );
    } else Array.from(x ?? y ?? []).forEach((value, k) => rows.push([name, x ? value : k, y?.[k], ""]));
  }
  return rows;
}

/**
 * @param {unknown} value
 * @returns {value is ArrayLike<unknown>}
 */
const isList = (value) => Array.isArray(value) || ArrayBuffer.isView(value);
