// Rows and lines of the comparison, for one output axis or one panel.

import { axisOf, signOf } from "../../core/positions.js";

/** @import { Comparison, ComparisonColumns, ModelLines } from "../../../../types/api.js" */
/** @typedef {ComparisonColumns & { rate: number[] }} Rows the columns of a comparison, and the rate about the turning axis, deg/s */

/**
 * Whether an axis turns in a position: `-z` turns z, the other way round.
 * @param {string} position
 * @param {string} axis
 */
export const turns = (position, axis) => axisOf(position) === axis;

/**
 * Some rows of columns of equal length.
 * @template {Record<string, readonly unknown[]>} Columns
 * @param {Columns} columns
 * @param {readonly number[]} rows
 */
export const pickRows = (columns, rows) =>
  /** @type {Columns} */ (
    /** @type {unknown} */ (
      Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, rows.map((k) => values[k])]))
    )
  );

/**
 * Columns of the rows for which `wanted(k, columns)` holds, with `rate`: about the turning axis, deg/s.
 * @param {Pick<Comparison, "columns">} comparison
 * @param {(k: number, columns: ComparisonColumns) => boolean} wanted
 * @returns {Rows}
 */
export function rowsWhere({ columns }, wanted) {
  const rows = columns.axis.map((_, k) => k).filter((k) => wanted(k, columns));
  const found = pickRows(columns, rows);
  return { ...found, rate: found.table_rate_dps.map((rate, k) => signOf(found.position[k]) * rate) };
}

/**
 * The rows of an output axis in which it turns itself; all of its rows where it never does.
 * @param {Pick<Comparison, "columns">} comparison
 * @param {string} axis
 */
export function ownRows(comparison, axis) {
  const own = rowsWhere(comparison, (k, columns) => columns.axis[k] === axis && turns(columns.position[k], axis));
  return own.dataset.length ? own : rowsWhere(comparison, (k, columns) => columns.axis[k] === axis);
}

/**
 * The lines of an output axis in the positions of some rows.
 * @param {readonly ModelLines[]} lines
 * @param {string} axis
 * @param {readonly string[]} positions
 */
export const linesOf = (lines, axis, positions) =>
  lines.filter((each) => each.axis === axis && positions.includes(each.position));

/**
 * Lines over the table rate as lines over the rate about the axis, and back: [x, y] of one line.
 * @template Y
 * @param {Pick<ModelLines, "at" | "position">} line
 * @param {Y} y
 * @returns {[x: number[], y: Y]}
 */
export const alongRate = ({ at, position }, y) => [at.map((rate) => signOf(position) * rate), y];
/** @param {{ position: readonly string[] }} rows */
export const positionsOf = (rows) => [...new Set(rows.position)];
/** @param {readonly number[]} values */
export const rms = (values) =>
  Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / Math.max(values.length, 1));
/**
 * @param {readonly number[]} values
 * @returns {[number, number]}
 */
export const span = (values) => [Math.min(...values), Math.max(...values)];
