// Cells of the residual map: data sets that share a rate and a temperature.

import { number, plainNumber } from "../core/format.js";

/** @import { Criticism, RecordingRow, ResidualMap } from "../../../types/api.js" */

/** @typedef {ReturnType<typeof mapCells>["cells"][number]} Cell */

/** End of the colour scale of every map, noise floors: the same for all versions, so that two of them compare. */
export const COLOUR_LIMIT = 5;
export const SCALE_TEXT = `The colours end at ${COLOUR_LIMIT} noise floors to either side, for every version; a cell beyond has the colour of the end.`;

/**
 * The maps of an axis, one for each position: columns of equal length, one number for each data set.
 * @param {Pick<Criticism, "maps">} criticism
 * @param {string} axis
 */
export const mapsOf = (criticism, axis) => criticism.maps.filter((map) => map.axis === axis);

/**
 * Whether a map over rate and temperature shows something: not at one rate, nor where each window has a rate of its own.
 * @param {{ criticism: Pick<Criticism, "maps">, axis: string, motion: RecordingRow["motion"] }} state
 */
export const hasMap = ({ criticism, axis, motion }) =>
  motion !== "profile" && new Set(mapsOf(criticism, axis).flatMap((map) => map.rate_level_dps)).size > 1;

/**
 * Which data sets share a cell, in words.
 * @param {Pick<Criticism, "maps">} criticism
 */
export function cellsText(criticism) {
  const width = Math.max(0, ...criticism.maps.map((map) => map.level_width_c));
  return `Data sets share a cell where rate and temperature repeat within 0.1 % and 0.25 K${width ? `; temperatures of one row are within ${plainNumber(width, 2)} K` : ""}.`;
}

/**
 * A cell in words: the temperature of its data set, of several that of their row.
 * @param {Cell} cell
 * @param {string} position
 */
export const cellText = ({ rate, temperature, own_c, mean, sets }, position) =>
  [
    `${plainNumber(rate)} deg/s, ${sets.length > 1 ? `row ${plainNumber(temperature)}` : plainNumber(own_c)} °C, ${position} up`,
    `${number(mean, 2)} times the noise floor`,
    `data set ${sets.slice(0, 6).join(", ")}${sets.length > 6 ? " …" : ""}`,
  ].join("<br>");

/** @param {readonly number[]} values */
const sorted = (values) => [...new Set(values)].sort((a, b) => a - b);

/**
 * Measured cells of one map: their rates and temperatures, and each cell's mean score and data sets.
 * @param {Pick<ResidualMap, "dataset" | "temperature_c" | "rate_level_dps" | "temperature_level_c" | "over_floor">} map
 */
export function mapCells(map) {
  /** @type {Map<string, { rate: number, temperature: number, own_c: number, sum: number, sets: number[] }>} */
  const found = new Map();
  map.dataset.forEach((set, k) => {
    const [rate, temperature] = [map.rate_level_dps[k], map.temperature_level_c[k]];
    const cell = found.get(`${rate} ${temperature}`) ?? {
      rate,
      temperature,
      own_c: map.temperature_c[k],
      sum: 0,
      sets: [],
    };
    found.set(`${rate} ${temperature}`, cell);
    cell.sum += map.over_floor[k];
    cell.sets.push(set);
  });
  const cells = [...found.values()].map((cell) => ({ ...cell, mean: cell.sum / cell.sets.length }));
  return { rates: sorted(map.rate_level_dps), temperatures: sorted(map.temperature_level_c), cells };
}
