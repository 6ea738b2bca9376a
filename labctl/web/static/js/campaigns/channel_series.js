// The channels of a campaign as series over its time: temperatures, table rate, and each channel of the data sets.

import { channelName, channelUnit } from "../recordings/channels.js";

/** @import { Campaign, CampaignPlan, Course } from "../../../types/api.js" */
/** @import { MeasuredSets } from "./course_numbers.js" */

/**
 * @typedef {object} Series
 * @property {string} id its name in an address
 * @property {string} name
 * @property {string} unit
 * @property {number[]} t_s of the campaign, ascending
 * @property {(number | null)[]} values
 * @property {"line" | "hold" | "points"} drawn as a line, as a value held until the next, or as points
 * @property {{ serial: string, channel: string, dataset: number[] }} [means] of which data sets the points are means
 */
/** @typedef {{ serial: string, sets: MeasuredSets }} Measured */

/**
 * Every series that is known: the environment as it was logged, the rate of each step, the mean of each data set.
 * @param {Course} course
 * @param {CampaignPlan["timeline"]} steps
 * @param {readonly Measured[]} measured
 * @returns {Series[]}
 */
export const allSeries = (course, steps, measured) => [
  environment(course, "setpoint", "set point of the chamber", course.setpoint_c, "hold"),
  environment(course, "chamber", "chamber", course.chamber_c),
  ...Object.entries(course.units_c).map(([serial, values]) =>
    environment(course, `unit.${serial}`, `${serial}, own temperature`, values),
  ),
  tableRate(steps),
  ...measured.flatMap((each) => datasetMeans(each, steps)),
];

/**
 * @param {Course} course
 * @param {string} id
 * @param {string} name
 * @param {readonly (number | null)[]} values
 * @param {Series["drawn"]} [drawn]
 * @returns {Series}
 */
const environment = (course, id, name, values, drawn = "line") => ({
  id,
  name,
  unit: "°C",
  t_s: [...course.t_s],
  values: [...values],
  drawn,
});

/**
 * The rate of each step that has begun; at rest where a step turns nothing.
 * @param {CampaignPlan["timeline"]} steps
 * @returns {Series}
 */
function tableRate(steps) {
  /** @type {Series} */
  const rate = { id: "rate", name: "table rate", unit: "deg/s", t_s: [], values: [], drawn: "hold" };
  steps.started_s.forEach((from, k) => {
    if (from === null) return;
    rate.t_s.push(from);
    rate.values.push(steps.rate_dps[k] ?? 0);
  });
  return rate;
}

/**
 * The mean of each channel of each data set, at the middle of its step.
 * @param {Measured} measured
 * @param {CampaignPlan["timeline"]} steps
 * @returns {Series[]}
 */
function datasetMeans({ serial, sets }, steps) {
  const middle = new Map();
  steps.dataset.forEach((dataset, k) => {
    const [from, until] = [steps.started_s[k], steps.ended_s[k]];
    if (dataset !== null && from !== null && until !== null) middle.set(dataset, (from + until) / 2);
  });
  const rows = sets.number.flatMap((number, row) => (middle.has(number) ? [row] : []));
  rows.sort((a, b) => middle.get(sets.number[a]) - middle.get(sets.number[b]));
  return Object.entries(sets.channels).map(([channel, { mean }]) => ({
    id: `mean.${serial}.${channel}`,
    name: `${serial}, ${channelName(channel)} (means)`,
    unit: channelUnit(channel, sets.output),
    t_s: rows.map((row) => middle.get(sets.number[row])),
    values: rows.map((row) => mean[row]),
    drawn: "points",
    means: { serial, channel, dataset: rows.map((row) => sets.number[row]) },
  }));
}

/**
 * Add what a progress message says of now to the series of the environment and to those of the outputs.
 * @param {Map<string, Series>} live the series since the page was opened, by id
 * @param {Campaign} status
 */
export function appendLive(live, status) {
  for (const output of status.outputs) {
    const id = `now.${output.gyro}.${output.channel}`;
    const name = `${output.gyro}, ${channelName(output.channel)}, now`;
    append(live, { id, name, unit: output.unit, drawn: "line" }, output.t_s, output.mean);
  }
  for (const [column, value] of Object.entries(status.references)) {
    const id = `now.${column}`;
    append(
      live,
      { id, name: `${channelName(column)}, now`, unit: channelUnit(column), drawn: "line" },
      status.t_s,
      value,
    );
  }
}

/**
 * @param {Map<string, Series>} live
 * @param {Pick<Series, "id" | "name" | "unit" | "drawn">} about
 * @param {number | null} t_s
 * @param {number} value
 */
function append(live, about, t_s, value) {
  const series = live.get(about.id) ?? { ...about, t_s: [], values: [] };
  live.set(about.id, series);
  if (t_s === null || t_s <= (series.t_s.at(-1) ?? -Infinity)) return;
  series.t_s.push(t_s);
  series.values.push(value);
}

/**
 * A series from a time on; a value that is held begins there with what held before.
 * @param {Series} series
 * @param {number} from_s
 * @param {number} until_s
 * @returns {Series}
 */
export function inRange(series, from_s, until_s) {
  const kept = series.t_s.flatMap((t, k) => (t >= from_s && t <= until_s ? [k] : []));
  const [t_s, values] = [kept.map((k) => series.t_s[k]), kept.map((k) => series.values[k])];
  if (series.drawn === "hold") {
    const before = series.t_s.findLastIndex((t) => t < from_s);
    if (before >= 0) {
      t_s.unshift(from_s);
      values.unshift(series.values[before]);
    }
    if (t_s.length) {
      t_s.push(until_s);
      values.push(values[values.length - 1]);
    }
  }
  const { means } = series;
  return {
    ...series,
    t_s,
    values,
    ...(means ? { means: { ...means, dataset: kept.map((k) => means.dataset[k]) } } : {}),
  };
}

/**
 * The series by unit, in the order in which the units first come.
 * @param {readonly Series[]} series
 */
export function panels(series) {
  /** @type {Map<string, Series[]>} */
  const byUnit = new Map();
  for (const each of series) byUnit.set(each.unit, [...(byUnit.get(each.unit) ?? []), each]);
  return [...byUnit.entries()];
}
