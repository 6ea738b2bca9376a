// Positions of a unit: `-x` is x down; `x@180` the unit turned on its fixture, `x@0/90` the fixture turned on the table.

/** @typedef {"x" | "y" | "z"} Axis */

const FORM = /^(-?)([xyz])(?:@(\d+)(?:\/(\d+))?)?$/;

/** @param {string} position */
const parts = (position) => FORM.exec(position) ?? ["", "", "z", "0", "0"];

/**
 * The body axis along the table axis.
 * @param {string} position
 */
export const axisOf = (position) => /** @type {Axis} */ (parts(position)[2]);

/**
 * 1, or -1 where the other end of the axis points up.
 * @param {string} position
 */
export const signOf = (position) => (parts(position)[1] ? -1 : 1);

/**
 * By which the unit is turned on its fixture, and the fixture on the table, deg, counter-clockwise seen from above.
 * @param {string} position
 * @returns {[number, number]}
 */
export const turnedDeg = (position) => [Number(parts(position)[3] ?? 0), Number(parts(position)[4] ?? 0)];

/**
 * Which end of which axis points up, `x` or `-x`.
 * @param {string} position
 */
export const endOf = (position) => parts(position)[1] + axisOf(position);
