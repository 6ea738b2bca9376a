// Cells for a notebook: the Python client gives exactly what a figure or a point of the page shows.

/** @import { ExploreState } from "./state.js" */

/** @typedef {Pick<ExploreState, "serial" | "version" | "recordings" | "axis">} Of */

/** What the answer of the residuals has a column of; times are drawn in hours. @type {Record<string, [string, string]>} */
const CHANNELS = {
  table_rate_dps: ["columns.table_rate_dps[k]", "table rate, deg/s"],
  temperature_c: ["columns.temperature_c[k]", "gyro temperature, deg C"],
  t_s: ["columns.t_s[k] / 3600", "time, h"],
};

/** @param {unknown} text */
const quoted = (text) => JSON.stringify(text);

/**
 * @param {Of} of
 * @param {string} origin
 */
const opening = ({ serial, version, recordings, axis }, origin) => `from labctl.client import Client

client = Client(${quoted(origin)})
serial, version, recordings, axis = ${quoted(serial)}, ${version}, [${recordings.join(", ")}], ${quoted(axis)}
`;

/**
 * The cell of a figure of the residual against a channel; null for a channel that the answer has no column of.
 * @param {Of} of
 * @param {string} channel
 * @param {string} origin
 */
export function residualCell(of, channel, origin) {
  if (!(channel in CHANNELS)) return null;
  const [value, title] = CHANNELS[channel];
  return `${opening(of, origin)}
import plotly.graph_objects as go

columns = client.residuals(serial, version, recordings=recordings).columns
rows = [k for k, each in enumerate(columns.axis) if each == axis]
x, y = [${value} for k in rows], [columns.residual_dps[k] for k in rows]
figure = go.Figure(go.Scatter(x=x, y=y, mode="markers"))
figure.update_layout(xaxis_title=${quoted(title)}, yaxis_title="residual of the fitted model, deg/s")
figure
`;
}

/**
 * The cell of one point: its numbers, computed again from the raw readings.
 * @param {Of} of
 * @param {{ recording: number, dataset: number }} point
 * @param {string} origin
 */
export const pointCell = (of, { recording, dataset }, origin) => `${opening(of, origin)}
point = client.point(
    serial, version, recording=${recording}, dataset=${dataset}, axis=axis, recordings=recordings
)
print(point.formula)
print(point.summary)
`;
