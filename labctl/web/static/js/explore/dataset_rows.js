// Data sets as columns: what the criticism says of each data set, for one axis of the gyro.

import { count, plainNumber } from "../core/format.js";

/** @import { Criticism, Preview } from "../../../types/api.js" */
/** @typedef {Pick<Criticism, "views">} Viewed */

/**
 * The columns of the data sets; a criticism that is shown has them, only one of a table of coefficients has none.
 * @param {Viewed} criticism
 */
const columnsOf = (criticism) => /** @type {Required<NonNullable<Viewed["views"]["sets"]>>} */ (criticism.views.sets);

/**
 * Return {n, dataset, recording, own, position, channels: {name: []}, residual, score} of one axis; lists of equal length.
 * Of several recordings `dataset` counts through all of them, `recording` and `own` say which it is; of one long data
 * set (`pieces`) it counts its pieces.
 * @param {Viewed} criticism
 * @param {string} axis
 */
export function datasetRows(criticism, axis) {
  const sets = columnsOf(criticism);
  return {
    n: sets.dataset.length,
    dataset: isOneInPieces(sets) ? sets.dataset.map((_, k) => k + 1) : sets.dataset,
    recording: sets.recording ?? null,
    pieces: isOneInPieces(sets),
    own: sets.own_dataset ?? sets.dataset,
    position: sets.position,
    channels: sets.channels,
    residual: sets.residual_dps[axis],
    score: sets.over_floor[axis],
  };
}

/**
 * Whether all rows are pieces of one data set, as of a unit at rest through a loop of the temperature.
 * @param {{ dataset: readonly number[], recording?: readonly number[] }} sets
 */
const isOneInPieces = ({ dataset, recording }) => !recording && dataset.length > 1 && new Set(dataset).size === 1;

/**
 * A data set in words: of several recordings also which, of one long data set which piece.
 * @param {{ recording: readonly number[] | null, own: readonly number[], dataset: readonly number[], pieces: boolean }} rows
 * @param {number} k
 */
export function setText({ recording, own, dataset, pieces }, k) {
  if (recording) return `recording ${recording[k]}, data set ${own[k]}`;
  return pieces ? `data set ${own[k]}, piece ${dataset[k]}` : `data set ${own[k]}`;
}

/** @param {Viewed} criticism */
export const axisNames = (criticism) => Object.keys(criticism.views.sets?.residual_dps ?? {});

/**
 * "n of N data sets" where not every data set is drawn one by one, else null.
 * @param {Viewed} criticism
 */
export function shownText(criticism) {
  const { of, dataset } = columnsOf(criticism);
  return dataset.length < of ? `${count(dataset.length)} of ${count(of)} data sets` : null;
}

/**
 * The values of an axis in the order of the criticism's data sets.
 * @param {{ criticism: Viewed, axis: string }} state
 * @param {Pick<Preview["residuals"], "dataset" | "axis" | "residual_dps"> & Partial<Pick<Preview["residuals"], "recording">>} columns
 * @param {"residual_dps"} name
 */
export function inDatasetOrder(state, columns, name) {
  const rows = datasetRows(state.criticism, state.axis);
  const of = rows.recording ? columns.recording : undefined; // a single recording needs no number
  /** @type {Map<string, number[]>} */
  const values = new Map(); // a long data set is in several pieces, in the same order in both
  columns.dataset.forEach((set, k) => {
    if (columns.axis[k] !== state.axis) return;
    const key = `${of?.[k] ?? ""} ${set}`;
    const found = values.get(key);
    if (found) found.push(columns[name][k]);
    else values.set(key, [columns[name][k]]);
  });
  const isThinned = shownText(state.criticism) !== null;
  /** @type {Map<string, number>} */
  const taken = new Map();
  return rows.own.map((set, k) => {
    const key = `${rows.recording?.[k] ?? ""} ${set}`;
    const found = values.get(key) ?? [];
    if (found.length < 2) return found[0] ?? null;
    const place = taken.get(key) ?? 0;
    taken.set(key, place + 1);
    return isThinned ? null : (found[place] ?? null); // of pieces that are thinned nothing says which is which
  });
}

/** What is smaller than this share of the largest value is no more than scatter about 0. */
const ZERO_SHARE = 1e-3;

/**
 * Numbers as short texts that all differ, so that no two categories of an axis become one: one that is near 0 beside the
 * others is 0, not 0.00964.
 * @param {readonly number[]} values
 */
export function distinctLabels(values) {
  const least = ZERO_SHARE * Math.max(0, ...values.map(Math.abs));
  for (let digits = 3; digits < 17; digits += 1) {
    const labels = values.map((value) => plainNumber(digits === 3 && Math.abs(value) < least ? 0 : value, digits));
    if (new Set(labels).size === values.length) return labels;
  }
  return values.map(String);
}

/**
 * Data-set numbers as `1-20,35`, for the query string.
 * @param {Iterable<number>} numbers
 */
export function toRanges(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  /** @type {[number, number][]} */
  const parts = [];
  for (const number of sorted) {
    const last = parts.at(-1);
    if (last && number === last[1] + 1) last[1] = number;
    else parts.push([number, number]);
  }
  return parts.map(([from, to]) => (from === to ? `${from}` : `${from}-${to}`)).join(",");
}

/** @param {string | undefined} text */
export function fromRanges(text) {
  /** @type {Set<number>} */
  const found = new Set();
  for (const part of (text ?? "").split(",").filter(Boolean)) {
    const [from, to = from] = part.split("-").map(Number);
    if (Number.isFinite(from) && Number.isFinite(to) && to - from < 100_000)
      for (let k = from; k <= to; k += 1) found.add(k);
  }
  return found;
}

/** @type {Record<string, string>} */
export const UNITS = {
  table_rate_dps: "deg/s",
  previous_rate_dps: "deg/s",
  temperature_c: "°C",
  chamber_c: "°C",
  reference_c: "°C",
  own_temperature_c: "°C",
  t_s: "h",
  power_s: "h",
  supply_v: "V",
  humidity_pct: "%",
};
/** @type {Record<string, string>} */
const NAMES = {
  table_rate_dps: "table rate",
  previous_rate_dps: "previous rate",
  temperature_c: "gyro temperature",
  chamber_c: "chamber temperature",
  reference_c: "reference temperature",
  own_temperature_c: "gyro's own temperature",
  t_s: "time",
  power_s: "time since power-on",
  supply_v: "supply",
  humidity_pct: "humidity",
  order: "data sets in order",
};
/**
 * A channel's values in the unit that its title names: hours for times.
 * @param {string} name
 * @param {readonly (number | null)[]} values
 */
export const scaled = (name, values) =>
  UNITS[name] === "h" ? values.map((value) => (value === null ? null : value / 3600)) : values;
/** @param {string} name */
export const channelName = (name) => NAMES[name] ?? name.replaceAll("_", " ");
/** @param {string} name */
export const channelTitle = (name) => (UNITS[name] ? `${channelName(name)}, ${UNITS[name]}` : channelName(name));
