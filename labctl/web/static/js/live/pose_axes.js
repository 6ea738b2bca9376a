// A pose in the drawing: the body axes as directions (front left, front right, up) of the picture, and a box in them.

/** @typedef {[number, number, number]} Point */

/**
 * @param {readonly number[]} a
 * @param {readonly number[]} b
 */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/**
 * @param {readonly number[]} a
 * @param {readonly number[]} b
 * @returns {Point}
 */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/**
 * @param {readonly number[]} a
 * @returns {Point}
 */
const unit = (a) => {
  const size = Math.hypot(...a);
  return [a[0] / size, a[1] / size, a[2] / size];
};

/** Above this share of x in the direction that is up, y says where the front is. */
const STEEP = 0.9;

/**
 * The body axes x, y, z in the picture when the direction `up` of the body points up. Gravity does not tell the heading:
 * x, or y where x is nearly vertical, is towards the front left.
 * @param {readonly number[]} up
 * @returns {[Point, Point, Point]}
 */
export function axesInPicture(up) {
  const third = unit(up);
  /** @type {Point} */
  const towards = Math.abs(third[0]) > STEEP ? [0, 1, 0] : [1, 0, 0];
  const along = dot(towards, third);
  const first = unit([0, 1, 2].map((k) => towards[k] - along * third[k]));
  const second = cross(third, first);
  /** @param {number} k @returns {Point} */
  const axis = (k) => [first[k], second[k], third[k]];
  return [axis(0), axis(1), axis(2)];
}

/** From the picture towards the eye: the direction that the projection of the drawing makes a point. */
const EYE = [1, 1, 0.84];

/**
 * The faces of a cube of half width 1 that are seen: their corners in the picture, and where they look to.
 * @param {readonly Point[]} axes
 */
export function seenFaces(axes) {
  /** @type {{ corners: Point[], side: "top" | "left" | "right" }[]} */
  const found = [];
  for (const k of [0, 1, 2])
    for (const sign of [1, -1]) {
      const normal = axes[k].map((v) => sign * v);
      if (dot(normal, EYE) <= 1e-9) continue;
      const [a, b] = [axes[(k + 1) % 3], axes[(k + 2) % 3]];
      const corners = [
        [1, 1],
        [-1, 1],
        [-1, -1],
        [1, -1],
      ].map(([p, q]) => /** @type {Point} */ ([0, 1, 2].map((j) => normal[j] + p * a[j] + q * b[j])));
      const side = normal[2] > 0.5 ? "top" : normal[0] >= normal[1] ? "left" : "right";
      found.push({ corners, side });
    }
  return found;
}

/**
 * How far below its middle the lowest corner of that cube is.
 * @param {readonly Point[]} axes
 */
export const depthBelow = (axes) => axes.reduce((sum, axis) => sum + Math.abs(axis[2]), 0);
