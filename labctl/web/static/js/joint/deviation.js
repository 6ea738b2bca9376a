// The standard deviation of what differs between recordings, as texts; no DOM here.

import { resultTexts } from "../core/format.js";

/** @import { Joint } from "../../../types/api.js" */
/** @typedef {Joint["repeatability"][string][number]} Repeatability */

/**
 * The standard deviation of a shift and its standard uncertainty, to the same place.
 * @param {Pick<Repeatability, "value" | "u" | "unit" | "term">} row
 * @returns {[deviation: string, u: string]}
 */
export function deviationTexts({ value, u, unit, term }) {
  const { middle, half, power, suffix } = resultTexts(value, u, unit, term);
  /** @param {string | null} text */
  const whole = (text) => (text === null ? "–" : [text, power, suffix].filter(Boolean).join(" "));
  return [whole(middle), whole(half)];
}
