// How near a watched value is to its limits, as numbers and words.

import { fixed, plainNumber } from "../core/format.js";

/** @import { WatchedLimit } from "../../../types/api.js" */

/** Share of a limit from which on a strip is amber. */
export const NEAR = 0.8;

/**
 * Share of the way to the nearest limit, 0 and more; 1 at the limit.
 * @param {WatchedLimit} limit
 */
export function usedShare({ value, low, high }) {
  if (low === null) return high > 0 ? value / high : value > 0 ? Infinity : 0;
  const [middle, half] = [(low + high) / 2, (high - low) / 2];
  return Math.abs(value - middle) / half;
}

/**
 * @param {WatchedLimit} limit
 * @returns {"good" | "warn" | "bad"}
 */
export const levelOf = (limit) => (limit.is_beyond ? "bad" : usedShare(limit) >= NEAR ? "warn" : "good");

/**
 * The nearest limit, and how far the value is from it; negative beyond it.
 * @param {WatchedLimit} limit
 */
export function nearest({ value, low, high }) {
  const above = high - value;
  if (low === null || above <= value - low) return { limit: high, distance: above };
  return { limit: low, distance: value - low };
}

/** @param {number} value */
const digits = (value) => (Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : 2);

/** @param {WatchedLimit} limit */
export const valueText = ({ value, unit }) =>
  `${unit ? fixed(value, digits(value)) : plainNumber(value)} ${unit}`.trim();

/**
 * Whether nothing at all is allowed: an alarm, or a motion while the table is to stand.
 * @param {WatchedLimit} limit
 */
const allowsNone = ({ low, high }) => low === null && high === 0;

/** @param {WatchedLimit} limit */
export function limitText(limit) {
  if (allowsNone(limit)) return "none allowed";
  const { low, high, unit } = limit;
  return `${low === null ? "at most" : `${plainNumber(low, 4)} to`} ${plainNumber(high, 4)} ${unit}`.trim();
}

/** @param {WatchedLimit} limit */
export function distanceText(limit) {
  if (!limit.unit || (allowsNone(limit) && !limit.is_beyond)) return limit.is_beyond ? "beyond its limit" : "none";
  const { distance } = nearest(limit);
  const size = `${fixed(Math.abs(distance), digits(distance))} ${limit.unit === "deg C" ? "K" : limit.unit}`;
  if (limit.is_beyond) return `${size} beyond`;
  return distance < 0 ? "a single reading" : `${size} left`;
}

/** @param {WatchedLimit} limit */
export const ageText = ({ age_s }) => (age_s === null ? "" : `${fixed(age_s, age_s < 10 ? 1 : 0)} s old`);

/**
 * Limits that are passed, in words for the title of the tab; "" where none is.
 * @param {readonly WatchedLimit[]} limits
 */
export function alarmText(limits) {
  const beyond = limits.filter((each) => each.is_beyond);
  return beyond.length ? `LIMIT ${beyond[0].device}` : "";
}
