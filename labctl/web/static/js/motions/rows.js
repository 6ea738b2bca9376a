// Rows of a recording by what moved the unit: of one axis, of one leg.

import { pickRows } from "../explore/compare/rows.js";

/**
 * The rows of one output axis.
 * @template {{ axis: readonly string[] } & Record<string, readonly unknown[]>} Columns
 * @param {Columns} columns
 * @param {string} axis
 */
export const ofAxis = (columns, axis) =>
  pickRows(
    columns,
    columns.axis.flatMap((each, k) => (each === axis ? [k] : [])),
  );

/**
 * "n of N rows": empty where all are there.
 * @param {{ rows: number, of: number }} found
 * @param {string} what
 */
export const shownOf = ({ rows, of }, what) =>
  rows < of ? ` Drawn: ${rows.toLocaleString("en-GB")} of ${of.toLocaleString("en-GB")} ${what}, evenly spaced.` : "";

/**
 * Values less others, null where one is null.
 * @param {readonly (number | null)[]} values
 * @param {readonly (number | null)[]} others
 */
export const lessThan = (values, others) =>
  values.map((value, k) => {
    const other = others[k];
    return value === null || other === null ? null : value - other;
  });

/**
 * Values times a factor, null where there is none.
 * @param {readonly (number | null)[]} values
 * @param {number} factor
 */
export const times = (values, factor) => values.map((value) => (value === null ? null : factor * value));
