// The ticks of the error ladder: at least one figure is named, and no two stand over each other.

import assert from "node:assert/strict";
import { test } from "node:test";

import { roundSizes, ticksOf } from "../../labctl/web/static/js/core/log_ticks.js";

/** @type {Record<string, readonly number[]>} the digits that Plotly names for a choice */
const DIGITS = { D1: [1, 2, 3, 4, 5, 6, 7, 8, 9], D2: [1, 2, 5] };
/** Labels that have room on an axis of 19 rem. */
const MOST = 12;

/**
 * The figures that are named from the least to the largest value.
 * @param {number} least
 * @param {number} largest
 */
function named(least, largest) {
  const ticks = ticksOf([largest, least]);
  if (!("dtick" in ticks)) return null;
  const decades = Array.from({ length: 12 }, (_, k) => 10 ** (k - 8));
  return decades
    .flatMap((decade) => DIGITS[ticks.dtick].map((digit) => digit * decade))
    .filter((figure) => figure >= least * (1 - 1e-9) && figure <= largest * (1 + 1e-9));
}

test("errors within a factor of 2 are divided evenly: between 0.021 and 0.029 there is no round figure", () => {
  for (const ratio of [1, 1.4, 1.99]) assert.deepEqual(ticksOf([0.021, 0.021 * ratio]), { nticks: 5 });
});

test("wherever the errors lie, the axis names a figure among them, and not too many", () => {
  for (let start = 1; start < 10; start += 0.13)
    for (const ratio of [2, 3, 4.99, 5, 20, 900]) {
      const figures = named(0.001 * start, 0.001 * start * ratio);
      assert.ok(figures && figures.length >= 1 && figures.length <= MOST, `${start} times ${ratio}: ${figures}`);
      if (ratio >= 3) assert.ok(figures.length >= 2, `${start} times ${ratio}: ${figures}`);
    }
});

test("an error of zero is not on the axis, and without any there is no division by zero", () => {
  assert.deepEqual(ticksOf([0, 0.02, 0.03]), { nticks: 5 });
  assert.deepEqual(ticksOf([0]), { nticks: 5 });
  assert.deepEqual(ticksOf([]), { nticks: 5 });
});

test("an axis that is drawn without Plotly names round sizes within its range, and has room for them", () => {
  assert.deepEqual(roundSizes(0.02083, 0.5566), [0.05, 0.1, 0.2, 0.5]);
  assert.deepEqual(roundSizes(0.0208, 0.0452), [0.03, 0.04]);
  assert.deepEqual(roundSizes(2e-5, 3), [1e-4, 1e-3, 0.01, 0.1, 1]);
});
