// Live calibration in words, and its uncertainties as lines of a plot.

/** @import { LiveHistory, LiveMoment } from "../../../types/api.js" */

/** A rest covers a pose within this angle, deg. */
export const NEAR_DEG = 17;

/**
 * What the unit does now.
 * @param {LiveMoment} moment
 * @param {number} rest_s
 */
export const stillText = ({ still_s }, rest_s) =>
  still_s > 0 ? `at rest for ${still_s.toFixed(1)} s of ${rest_s} s` : "in motion";

/**
 * How far the unit is from the pose that is asked for; empty without either.
 * @param {LiveMoment} moment
 */
export function offText({ off_deg }) {
  if (off_deg === null) return "";
  const off = `${off_deg.toFixed(0)} deg from the pose that is needed`;
  return off_deg <= NEAR_DEG ? `${off}: this is the pose` : off;
}

/**
 * What could not be used, and why: lines of the stream, readings, turns.
 * @param {LiveMoment} moment
 */
export const unusedTexts = ({ damaged, example, lost, left_out }) => [
  ...(damaged ? [`${damaged} lines or frames could not be read${example ? `; the first: ${example}` : ""}`] : []),
  ...(lost ? [`${lost} readings are missing from the stream`] : []),
  ...left_out,
];

/**
 * U of the coefficients that the target limits, as shares of their limits: 1 is the goal.
 * @param {LiveHistory} history
 */
export function sharesOfLimits(history) {
  return history.coefficients
    .filter((each) => each.limit !== null)
    .map((each) => ({
      axis: each.axis,
      name: each.name,
      t_s: history.t_s,
      share: each.expanded.map((u) => (u === null ? null : u / Number(each.limit))),
    }));
}
