// What an effect of another size would leave, and where two effects part.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  bandOf,
  leftWith,
  levelMeans,
  partingLevels,
  partingRecipe,
  rmsOf,
} from "../../labctl/web/static/js/explore/what_if_numbers.js";

const X = [-3, -2, -1, 0, 1, 2, 3];
const BASE = X.map((x) => [1, x]);
const CUBE = X.map((x) => x ** 3);
const Y = [4.1, 1.3, 0.4, 0.9, 1.2, 3.4, 9.7];

/**
 * The residual of a least squares fit of two columns, by the normal equations.
 * @param {readonly number[]} y
 */
function residual(y) {
  const [n, sx, sxx] = BASE.reduce(([a, b, c], [, x]) => [a + 1, b + x, c + x * x], [0, 0, 0]);
  const [sy, sxy] = y.reduce(([a, b], value, k) => [a + value, b + value * X[k]], [0, 0]);
  const slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
  const offset = (sy - slope * sx) / n;
  return y.map((value, k) => value - offset - slope * X[k]);
}

/**
 * The share of one list that leaves least of another.
 * @param {readonly number[]} before
 * @param {readonly number[]} part
 */
const bestShare = (before, part) =>
  before.reduce((sum, value, k) => sum + value * part[k], 0) / part.reduce((sum, value) => sum + value * value, 0);

test("a share of a linear effect leaves what a fit of all else with that size leaves", () => {
  const before = residual(Y);
  const cubic = residual(CUBE); // what of the cube the other columns cannot take
  const size = bestShare(before, cubic);
  const explained = cubic.map((value) => size * value);
  for (const share of [0, 0.4, 1, 1.7]) {
    const fixed = residual(Y.map((value, k) => value - share * size * CUBE[k]));
    leftWith(before, explained, share).forEach((value, k) => assert.ok(Math.abs((value ?? 0) - fixed[k]) < 1e-12));
  }
});

test("the fitted size is the one that leaves least", () => {
  const before = residual(Y);
  const explained = residual(CUBE).map((value) => bestShare(before, residual(CUBE)) * value);
  const at = (/** @type {number} */ share) => rmsOf(leftWith(before, explained, share));
  assert.ok(at(1) < at(0.98) && at(1) < at(1.02));
});

test("a data set without a value counts for nothing", () => {
  assert.deepEqual(leftWith([1, null, 3], [0.5, 0.5, null], 1), [0.5, null, null]);
  assert.equal(rmsOf([3, null, -3]), 3);
});

test("two effects part where their means differ by more than the noise of a mean", () => {
  const round = Math.round;
  const one = levelMeans([1, 1.1, 5, 5.1], [1, 1, 2, 2], round);
  const other = levelMeans([1, 1.1, 5, 5.1], [1, 1.1, 3, 3], round);
  assert.deepEqual(
    one.map((level) => level.n),
    [2, 2],
  );
  assert.deepEqual(partingLevels(one, other, 0.1), [5.05]);
  assert.deepEqual(partingLevels(one, other, 1), []);
});

test("a recipe has the rates where they part, evenly chosen, and the outermost", () => {
  const rates_dps = Array.from({ length: 40 }, (_, k) => k - 20);
  const text = partingRecipe({ name: "a b/c", rates_dps, temperatures_c: [43.21], positions: ["z"] });
  const listed = (/rates_dps = \[([^\]]*)\]/.exec(text)?.[1] ?? "").split(", ").map(Number);
  assert.ok(listed.length <= 12);
  assert.equal(listed[0], -20);
  assert.equal(listed.at(-1), 19);
  assert.match(text, /name = "a-b-c"/);
});

test("a coefficient that follows from another one leaves the band of the size", () => {
  const square = { value: 0.064, u: 0.0016, unit: "(rad/(rad/s))^2" };
  const root = { value: 0.253, u: 0.003, identified: true, at_most: null, unit: "rad/(rad/s)" };
  assert.equal(bandOf({ k_squared: square, k: root }), (2 * 0.0016) / 0.064);
  assert.equal(bandOf({ r3: square, r5: square }), null);
  assert.equal(bandOf({ r3: { ...square, u: null } }), null);
  assert.equal(bandOf({}), null);
});
