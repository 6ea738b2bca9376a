// Name and unit of a channel from the name of its column.

/** @import { Outputs } from "../../../types/api.js" */

/** @type {[ending: string, unit: string][]} */
const UNIT_SUFFIXES = [
  ["_dps", "deg/s"],
  ["_deg", "deg"],
  ["_c", "°C"],
  ["_pct", "%"],
  ["_ut", "uT"],
  ["_g", "g"],
  ["_v", "V"],
  ["_s", "s"],
];
/** @type {Record<string, string>} */
const NAMES = {
  table_rate_dps: "table rate",
  table_angle_deg: "table angle",
  temperature_c: "gyro temperature",
  chamber_c: "chamber temperature",
  reference_c: "reference temperature",
  own_temperature_c: "gyro's own temperature",
  power_s: "time since power-on",
  supply_v: "supply",
  t_s: "time",
  humidity_pct: "humidity",
};

/** @param {string} name */
const unitSuffix = (name) => UNIT_SUFFIXES.find(([end]) => name.endsWith(end));

/**
 * The unit of a column. A gyro output has the unit that the recording declares, deg/s by default.
 * @param {string} name
 * @param {Outputs} [output]
 */
export function channelUnit(name, output = {}) {
  if (name.startsWith("gyro_")) return output[name.slice(5)]?.unit ?? "deg/s";
  return unitSuffix(name)?.[1] ?? "";
}

/** @param {string} name */
export function channelName(name) {
  if (NAMES[name]) return NAMES[name];
  if (name.startsWith("gyro_")) return `gyro output ${name.slice(5)}`;
  const end = unitSuffix(name)?.[0] ?? "";
  return name.slice(0, name.length - end.length).replaceAll("_", " ");
}

/**
 * @param {string} name
 * @param {string} unit
 */
export const channelTitle = (name, unit) => (unit ? `${channelName(name)}, ${unit}` : channelName(name));
