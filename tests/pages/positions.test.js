// Positions of a unit, and the drawing that asks a person for one.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bodyAxes } from "../../labctl/web/static/js/bench/mounting_axes.js";
import { axisOf, endOf, isTilted, signOf, turnedDeg, upOf } from "../../labctl/web/static/js/core/positions.js";

test("a position says its axis, its end and what is turned", () => {
  assert.deepEqual([axisOf("-y"), signOf("-y"), endOf("-y"), turnedDeg("-y")], ["y", -1, "-y", [0, 0]]);
  assert.deepEqual([axisOf("x@180"), signOf("x@180"), endOf("x@180"), turnedDeg("x@180")], ["x", 1, "x", [180, 0]]);
  assert.deepEqual(turnedDeg("-z@0/90"), [0, 90]);
});

test("a tilted position has a direction and no axis", () => {
  const third = Math.sqrt(1 / 3);
  assert.deepEqual([axisOf("x+y+z"), signOf("-x-y-z"), endOf("x-y+z@90"), isTilted("x-y")], [null, 1, "x-y+z", true]);
  assert.ok(upOf("x-y-z@90").every((share, k) => Math.abs(share - [third, -third, -third][k]) < 1e-12));
  assert.deepEqual(upOf("3x+4z"), [0.6, 0, 0.8]);
  assert.deepEqual(turnedDeg("x+y+z@120"), [120, 0]);
});

test("the axes of a tilted unit are right-handed and add up to the direction that points up", () => {
  for (const end of ["x+y+z", "-x+y-z", "3x-4z"]) {
    for (const angle of [0, 37]) {
      const axes = bodyAxes(`${end}@${angle}`);
      cross(axes.x, axes.y).forEach((value, k) => assert.ok(Math.abs(value - axes.z[k]) < 1e-12));
      const up = upOf(end);
      const sum = [0, 1, 2].map((k) => up[0] * axes.x[k] + up[1] * axes.y[k] + up[2] * axes.z[k]);
      sum.forEach((value, k) => assert.ok(Math.abs(value - [0, 0, 1][k]) < 1e-12));
    }
  }
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
      assert.equal(axes[axisOf(end) ?? "z"][2], signOf(end));
    }
    const [straight, turned] = [bodyAxes(end), bodyAxes(`${end}@90`)];
    const level = /** @type {const} */ (["x", "y", "z"]).filter((name) => name !== axisOf(end));
    for (const name of level) assert.deepEqual(rounded(cross([0, 0, 1], straight[name])), rounded(turned[name]));
  }
});

test("the distance from the axis of the table is no part of what points up", () => {
  assert.deepEqual(
    [axisOf("zr200x"), endOf("zr200x"), signOf("-zr200-x"), turnedDeg("zr60x@180")],
    ["z", "z", -1, [180, 0]],
  );
  assert.deepEqual([endOf("x+y+zr200"), isTilted("x+y+zr200"), turnedDeg("xr60@0/90")], ["x+y+z", true, [0, 90]]);
});
