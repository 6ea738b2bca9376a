// Rows and lines of the comparison, for one output axis or one panel.

/** Whether an axis turns in a position: `-z` turns z, the other way round. */
export const turns = (position, axis) => position.replace("-", "") === axis;
const sign = (position) => (position.startsWith("-") ? -1 : 1);

/** Columns of the rows for which `wanted(k, columns)` holds, with `rate`: about the turning axis, deg/s. */
export function rowsWhere({ columns }, wanted) {
  const rows = columns.axis.map((_, k) => k).filter((k) => wanted(k, columns));
  const found = Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, rows.map((k) => values[k])]));
  found.rate = found.table_rate_dps.map((rate, k) => sign(found.position[k]) * rate);
  return found;
}

/** The rows of an output axis in which it turns itself; all of its rows where it never does. */
export function ownRows(comparison, axis) {
  const own = rowsWhere(comparison, (k, columns) => columns.axis[k] === axis && turns(columns.position[k], axis));
  return own.dataset.length ? own : rowsWhere(comparison, (k, columns) => columns.axis[k] === axis);
}

/** The lines of an output axis in the positions of some rows. */
export const linesOf = (lines, axis, positions) =>
  lines.filter((each) => each.axis === axis && positions.includes(each.position));

/** Lines over the table rate as lines over the rate about the axis, and back: [x, y] of one line. */
export const alongRate = ({ at, position }, y) => [at.map((rate) => sign(position) * rate), y];
export const positionsOf = (rows) => [...new Set(rows.position)];
export const signOf = sign;
export const rms = (values) =>
  Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / Math.max(values.length, 1));
export const span = (values) => [Math.min(...values), Math.max(...values)];
