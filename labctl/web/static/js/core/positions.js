// Positions of a unit: `-x` is x down, `x+y+z` a tilted unit; `x@180` the unit turned on its fixture, `x@0/90` the
// fixture turned on the table; `zr200x` the unit at 200 mm from the axis of the table, body axis x pointing away from it.

/** @typedef {"x" | "y" | "z"} Axis */
/** @typedef {[number, number, number]} Shares of x, y and z */

const AXES = /** @type {const} */ (["x", "y", "z"]);
const FORM = /^([^@r]*)(?:r\d+(?:-?[xyz])?)?(?:@(\d+)(?:\/(\d+))?)?$/;
const TERM = /([+-]?)(\d*)([xyz])/g;

/** @param {string} position */
const parts = (position) => FORM.exec(position) ?? ["", "z", "0", "0"];

/**
 * What points up: an end of an axis, `x` or `-x`, or a sum of axes.
 * @param {string} position
 */
export const endOf = (position) => parts(position)[1];

/**
 * The unit vector along the table axis, upwards, in the frame of the unit.
 * @param {string} position
 * @returns {Shares}
 */
export function upOf(position) {
  /** @type {Shares} */
  const shares = [0, 0, 0];
  for (const [, sign, size, axis] of endOf(position).matchAll(TERM))
    shares[AXES.indexOf(/** @type {Axis} */ (axis))] = (sign === "-" ? -1 : 1) * Number(size || 1);
  const length = Math.hypot(...shares) || 1;
  return /** @type {Shares} */ (shares.map((share) => share / length));
}

/**
 * Whether no body axis lies along the table axis.
 * @param {string} position
 */
export const isTilted = (position) => upOf(position).filter(Boolean).length > 1;

/**
 * The body axis along the table axis; of a tilted unit none.
 * @param {string} position
 * @returns {Axis | null}
 */
export const axisOf = (position) => (isTilted(position) ? null : (AXES.find((_, k) => upOf(position)[k]) ?? "z"));

/**
 * 1, or -1 where the other end of the axis points up; of a tilted unit 1.
 * @param {string} position
 */
export const signOf = (position) => (!isTilted(position) && Math.min(...upOf(position)) < 0 ? -1 : 1);

/**
 * By which the unit is turned on its fixture, and the fixture on the table, deg, counter-clockwise seen from above.
 * @param {string} position
 * @returns {[number, number]}
 */
export const turnedDeg = (position) => [Number(parts(position)[2] ?? 0), Number(parts(position)[3] ?? 0)];
