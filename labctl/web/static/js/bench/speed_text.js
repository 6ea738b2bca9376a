// The speed of simulated time in words, where the computer does not reach the one that was asked for.

/** @import { Bench } from "../../../types/api.js" */

/** Below this share of the asked speed the page says so, as the log does. */
const SLOW_SHARE = 0.9;

/**
 * Empty where the speed is reached, or where there is none.
 * @param {Pick<Bench, "speed" | "speed_reached">} bench
 */
export function slowText({ speed, speed_reached: reached }) {
  if (speed == null || reached == null || reached >= SLOW_SHARE * speed) return "";
  const shown = Number(reached.toPrecision(2));
  return `Simulated time runs at ${shown} times real time; ${speed} was asked for, which this computer does not reach now.`;
}
