// Channels by the name of their column, which ends in its unit.

const ENDINGS = [["_dps", "deg/s"], ["_deg", "deg"], ["_c", "deg C"], ["_pct", "%"], ["_ut", "uT"], ["_g", "g"], ["_v", "V"], ["_s", "s"]];
const NAMES = {
  table_rate_dps: "table rate", table_angle_deg: "table angle", temperature_c: "gyro temperature", chamber_c: "chamber temperature",
  power_s: "time since power-on", supply_v: "supply", t_s: "time", humidity_pct: "humidity",
};

const ending = (name) => ENDINGS.find(([end]) => name.endsWith(end));

/** The unit of a column; of an output without one it is what the recording says, deg/s where it says nothing. */
export function unitOf(name, output = {}) {
  if (name.startsWith("gyro_")) return output[name.slice(5)]?.unit ?? "deg/s";
  return ending(name)?.[1] ?? "";
}

export function nameOf(name) {
  if (NAMES[name]) return NAMES[name];
  if (name.startsWith("gyro_")) return `gyro output ${name.slice(5)}`;
  const end = ending(name)?.[0] ?? "";
  return name.slice(0, name.length - end.length).replaceAll("_", " ");
}

export const titleOf = (name, unit) => (unit ? `${nameOf(name)}, ${unit}` : nameOf(name));
