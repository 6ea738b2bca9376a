// Words around the catalogue: what an origin means, what a view shows, how a size is told.

import { number, setting } from "../core/format.js";

export const ORIGINS = {
  sensor: ["Sensor", "What the sensing element and its electronics do."],
  package: ["Package", "How the sensing axes lie in the unit's case."],
  fixture: ["Fixture", "How the unit sits on the table. Fitted, so that it does not hide in the gyro's coefficients; stays here."],
  bench: ["Bench", "What table and thermometer do. Reported against the bench; stays here."],
  environment: ["Environment", "The Earth, its field, and what changes from one switching-on to the next. Stays here."],
};

export const VIEWS = {
  map: "the map over rate and temperature", time: "the course in time", angle: "the waves in the table angle", frequency: "the waves in time", time_in_set: "the mean course of a data set", legs: "from below against from above",
  previous_rate: "against the rate before", repeats: "points measured again", worst: "the worst data sets", table_rate_dps: "against the table rate", temperature_c: "against the gyro's temperature", power_s: "against the time since power-on", supply_v: "against the supply voltage",
};

export const CHANNELS = {
  t_s: "time of each reading", power_s: "time since power-on", table_angle_deg: "table angle", supply_v: "supply voltage", raw_code: "the raw code of the converter", run: "number of the powered session", mounting: "number of the mounting",
};

export const TECHNOLOGIES = { fog: "Fibre-optic (FOG)", mems: "MEMS", piezo: "Piezoelectric vibrating" };

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵" };
/** A unit as a person reads it: (deg/s)^-1 -> (deg/s)⁻¹. A plain number has none. */
export const unitWords = (unit) => (unit === "1" ? "" : (unit ?? "").replace(/\^(-?\d)/g, (_, power) => [...power].map((sign) => RAISED[sign] ?? sign).join("")));

/** A size with its unit; a plain number is a share of the rate, or of the full effect: 14 ppm, 2.7 %. */
export function sizeWords(value, unit, digits = 2) {
  if (!Number.isFinite(value)) return "–";
  if (unit !== "1") return `${value === 0 ? "0" : number(value, digits)} ${unitWords(unit)}`;
  return Math.abs(value) >= 0.01 ? `${setting(100 * value, digits)} %` : `${setting(1e6 * value, digits)} ppm`;
}
