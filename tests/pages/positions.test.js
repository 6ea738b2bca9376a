// Positions of a unit, and the drawing that asks a person for one.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bodyAxes } from "../../labctl/web/static/js/bench/mounting_axes.js";
import { axisOf, endOf, signOf, turnedDeg } from "../../labctl/web/static/js/core/positions.js";

test("a position says its axis, its end and what is turned", () => {
  assert.deepEqual([axisOf("-y"), signOf("-y"), endOf("-y"), turnedDeg("-y")], ["y", -1, "-y", [0, 0]]);
  assert.deepEqual([axisOf("x@180"), signOf("x@180"), endOf("x@180"), turnedDeg("x@180")], ["x", 1, "x", [180, 0]]);
  assert.deepEqual(turnedDeg("-z@0/90"), [0, 90]);
});

/** @type {(a: readonly number[], b: readonly number[]) => number[]} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {readonly number[]} values */
const rounded = (values) => values.map((value) => Math.round(value) + 0);

test("the axes that are drawn are right-handed, and turn counter-clockwise seen from above", () => {
  for (const end of ["x", "-x", "y", "-y", "z", "-z"]) {
    for (const angle of [0, 90, 180, 270]) {
      const axes = bodyAxes(angle ? `${end}@${angle}` : end);
      assert.deepEqual(rounded(cross(axes.x, axes.y)), rounded(axes.z));
      assert.equal(axes[axisOf(end)][2], signOf(end));
    }
    const [straight, turned] = [bodyAxes(end), bodyAxes(`${end}@90`)];
    const level = /** @type {const} */ (["x", "y", "z"]).filter((name) => name !== axisOf(end));
    for (const name of level) assert.deepEqual(rounded(cross([0, 0, 1], straight[name])), rounded(turned[name]));
  }
});
