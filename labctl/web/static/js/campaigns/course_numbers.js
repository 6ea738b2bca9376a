// What a campaign was doing at one time: the sample of its course, its step, its data set.

import { duration, fixed, idText, plainNumber } from "../core/format.js";
import { channelUnit } from "../recordings/channels.js";

/** @import { CampaignPlan, Course, DataSets, Outputs } from "../../../types/api.js" */

/** @typedef {CampaignPlan["timeline"]} Steps */
/** @typedef {DataSets & { output: Outputs }} MeasuredSets data sets, and the declared unit of each output */

/**
 * Index of the last of ascending times that is not after a time; 0 before the first.
 * @param {readonly number[]} times
 * @param {number} t_s
 */
export function indexAt(times, t_s) {
  let [low, high] = [0, times.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t_s) low = middle;
    else high = middle;
  }
  return low;
}

/**
 * Index of the step that runs at a time; null between steps.
 * @param {Steps} steps
 * @param {number} t_s
 */
export function stepAt(steps, t_s) {
  const found = steps.number.findLastIndex((_, k) => {
    const [from, until] = [steps.started_s[k], steps.ended_s[k]];
    return from !== null && from <= t_s && (until === null || t_s <= until);
  });
  return found < 0 ? null : found;
}

/**
 * The soaks that have begun, to lay one over another.
 * @param {Steps} steps
 */
export const soaksOf = (steps) =>
  steps.number.flatMap((number, k) => {
    const [from, until] = [steps.started_s[k], steps.ended_s[k]];
    if (steps.kind[k] !== "soak" || from === null) return [];
    return [{ number, from, until: until ?? Infinity, temperature_c: steps.temperature_c[k] }];
  });

/**
 * What is read at one time, in words: time, step, air, units, output of the data set.
 * @param {{ course: Course, steps: Steps, datasets: MeasuredSets | null }} all
 * @param {number} t_s
 * @returns {[name: string, text: string][]}
 */
export function readingsAt({ course, steps, datasets }, t_s) {
  const k = indexAt(course.t_s, t_s);
  const step = stepAt(steps, t_s);
  const dataset = step === null ? null : steps.dataset[step];
  /** @param {number | null | undefined} value */
  const warm = (value) => (typeof value === "number" ? `${fixed(value, 2)} °C` : "–");
  /** @type {[string, string][]} */
  const rows = [
    ["Time", duration(t_s)],
    ["Step", step === null ? "between two steps" : `${steps.number[step]}: ${idText(steps.kind[step])}`],
    ["Set point", warm(course.setpoint_c[k])],
    ["Chamber", warm(course.chamber_c[k])],
    ...Object.entries(course.units_c).map(
      ([serial, values]) => /** @type {[string, string]} */ ([serial, warm(values[k])]),
    ),
    [
      "Table rate",
      step === null || steps.rate_dps[step] === null ? "at rest" : `${plainNumber(steps.rate_dps[step])} deg/s`,
    ],
  ];
  const row = dataset === null ? -1 : (datasets?.number.indexOf(dataset) ?? -1);
  if (!datasets || row < 0) return rows;
  rows.push(["Data set", `${dataset}: ${datasets.state[row]}`]);
  for (const [name, channel] of Object.entries(datasets.channels))
    if (name.startsWith("gyro_") && channel.mean[row] !== null)
      rows.push([
        name.replaceAll("_", " "),
        `${plainNumber(channel.mean[row], 7)} ${channelUnit(name, datasets.output)}`,
      ]);
  return rows;
}

/**
 * A soak against its own beginning: minutes, and how far a temperature is from the last set point, K.
 * @param {Course} course
 * @param {readonly (number | null)[]} values deg C
 * @param {{ from: number, until: number, temperature_c: number | null }} soak
 */
export function soakCourse(course, values, soak) {
  /** @type {{ x: number[], y: (number | null)[] }} */
  const columns = { x: [], y: [] };
  course.t_s.forEach((t, k) => {
    if (t < soak.from || t > soak.until) return;
    const target = course.setpoint_c[k] ?? soak.temperature_c;
    const value = values[k];
    columns.x.push((t - soak.from) / 60);
    columns.y.push(value === null || target === null ? null : value - target);
  });
  return columns;
}
