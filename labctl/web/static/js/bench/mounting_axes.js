// The body axes of a mounted unit as directions in the drawing.

import { axisOf, signOf, turnedDeg } from "../core/positions.js";

/** @import { Axis } from "../core/positions.js" */
/** @typedef {[number, number, number]} Point front left, front right, up */

export const AXES = /** @type {const} */ (["x", "y", "z"]);

/**
 * The body axes as directions (front left, front right, up) when `position` points up; right-handed also upside down.
 * @param {string} position
 */
export function bodyAxes(position) {
  const up = AXES.indexOf(axisOf(position));
  const down = signOf(position) < 0;
  const turned = (turnedDeg(position).reduce((sum, angle) => sum + angle) * Math.PI) / 180;
  const [cos, sin] = [Math.cos(turned), Math.sin(turned)];
  const [next, last] = [AXES[(up + 1) % 3], AXES[(up + 2) % 3]];
  /** @type {Record<Axis, Point>} */
  const at = { x: [0, 0, 0], y: [0, 0, 0], z: [0, 0, 0] };
  at[AXES[up]] = down ? [0, 0, -1] : [0, 0, 1];
  at[next] = down ? [-sin, cos, 0] : [cos, sin, 0];
  at[last] = down ? [cos, sin, 0] : [-sin, cos, 0];
  return at;
}
