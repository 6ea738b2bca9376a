// CSV files of figures.

import { MINUS } from "./rounding.js";
import { withoutCelsius } from "./typeset.js";

/** @import { CsvRows, PlotLayout, PlotTrace } from "../../../types/pages.js" */

/**
 * A name as that of a file: "Error over rate" -> "error-over-rate".
 * @param {string} name
 */
export const fileName = (name) =>
  name
    .toLowerCase()
    .replaceAll(/[^a-z0-9]+/g, "-")
    .replaceAll(/^-|-$/g, "");

/**
 * A cell as text; its numbers and units have the signs that programs read, also where the page wrote them as labels.
 * @param {unknown} cell
 */
function cellText(cell) {
  const text = withoutCelsius(String(cell ?? "").replaceAll(MINUS, "-"));
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}

/**
 * Rows as CSV; cells with commas, quotes and line ends are quoted, null and undefined are empty.
 * @param {CsvRows} rows
 */
export const csvText = (rows) => rows.map((row) => row.map(cellText).join(",")).join("\n") + "\n";

/**
 * The numbers of Plotly traces as rows, under the titles of the axes, which carry their units. Traces that only help
 * to pick or to shade (`hoverinfo` "skip") are none of the figure's numbers.
 * @param {readonly PlotTrace[]} traces
 * @param {PlotLayout} [layout]
 */
export function traceRows(traces, layout = {}) {
  /** @type {unknown[][]} */
  const rows = [["trace", axisTitle(layout, "x"), axisTitle(layout, "y"), axisTitle(layout, "z")]];
  for (const { name = "", x, y, z, hoverinfo } of traces) {
    if (hoverinfo === "skip") continue;
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
 * The title that all axes of a letter share; the letter where they have none, or different ones.
 * @param {PlotLayout} layout
 * @param {"x" | "y" | "z"} letter
 */
function axisTitle(layout, letter) {
  const axes = Object.entries({ ...layout, ...layout.scene }).filter(([name]) => name.startsWith(`${letter}axis`));
  const titles = new Set(axes.map(([, axis]) => axis?.title?.text).filter(Boolean));
  return titles.size === 1 ? String([...titles][0]).replaceAll(/<[^>]*>/g, " ") : letter;
}

/**
 * @param {unknown} value
 * @returns {value is ArrayLike<unknown>}
 */
const isList = (value) => Array.isArray(value) || ArrayBuffer.isView(value);
