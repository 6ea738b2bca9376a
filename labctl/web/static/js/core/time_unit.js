// The unit of a time axis.

const HOUR = { name: "h", seconds: 3600 };
const MINUTE = { name: "min", seconds: 60 };
const SECOND = { name: "s", seconds: 1 };
const MINUTES_FROM_S = 600;

/**
 * The unit for a span of time: hours from `hoursFrom_s` on, minutes from 10 min on, else seconds.
 * @param {number} span_s
 * @param {number} hoursFrom_s
 */
export const timeUnit = (span_s, hoursFrom_s) =>
  span_s >= hoursFrom_s ? HOUR : span_s >= MINUTES_FROM_S ? MINUTE : SECOND;
