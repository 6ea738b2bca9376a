// The body axes of a mounted unit as directions in the drawing.

import { axisOf, signOf, turnedDeg, upOf } from "../core/positions.js";

/** @import { Axis } from "../core/positions.js" */
/** @typedef {[number, number, number]} Point front left, front right, up */

export const AXES = /** @type {const} */ (["x", "y", "z"]);

/**
 * The body axes as directions (front left, front right, up) when `position` points up; right-handed also upside down.
 * @param {string} position
 */
export function bodyAxes(position) {
  const turned = (turnedDeg(position).reduce((sum, angle) => sum + angle) * Math.PI) / 180;
  const [cos, sin] = [Math.cos(turned), Math.sin(turned)];
  const axis = axisOf(position);
  if (axis === null) return tilted(upOf(position), cos, sin);
  const up = AXES.indexOf(axis);
  const down = signOf(position) < 0;
  const [next, last] = [AXES[(up + 1) % 3], AXES[(up + 2) % 3]];
  /** @type {Record<Axis, Point>} */
  const at = { x: [0, 0, 0], y: [0, 0, 0], z: [0, 0, 0] };
  at[AXES[up]] = down ? [0, 0, -1] : [0, 0, 1];
  at[next] = down ? [-sin, cos, 0] : [cos, sin, 0];
  at[last] = down ? [cos, sin, 0] : [-sin, cos, 0];
  return at;
}

/**
 * The same for a direction of the body that points up and is along none of its axes.
 * @param {Point} up
 * @param {number} cos of the angle by which the unit is turned
 * @param {number} sin
 */
function tilted(up, cos, sin) {
  const least = up.map(Math.abs).indexOf(Math.min(...up.map(Math.abs)));
  const across = up.map((share, k) => (k === least ? 1 : 0) - up[least] * share);
  const first = across.map((value) => value / Math.hypot(...across));
  const second = [0, 1, 2].map((k) => up[(k + 1) % 3] * first[(k + 2) % 3] - up[(k + 2) % 3] * first[(k + 1) % 3]);
  /** @type {(k: number) => Point} */
  const at = (k) => [cos * first[k] - sin * second[k], sin * first[k] + cos * second[k], up[k]];
  return /** @type {Record<Axis, Point>} */ ({ x: at(0), y: at(1), z: at(2) });
}
