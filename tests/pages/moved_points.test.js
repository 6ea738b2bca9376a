// Levels that a person moves: on a step, in the range, never on one another.

import assert from "node:assert/strict";
import test from "node:test";

import { movedLevel, shownRange, stepOf } from "../../labctl/web/static/js/campaigns/point_numbers.js";

test("a level is put on the step of the range", () => {
  assert.equal(stepOf([-100, 100]), 1);
  assert.equal(stepOf([20, 50]), 0.1);
  assert.equal(movedLevel([-40, 0, 40], 2, 37.4, [-100, 100]), 37);
  assert.equal(movedLevel([24, 26, 28], 0, 23.4567, [20, 50]), 23.5);
});

test("a level stays in the range and off the others", () => {
  assert.equal(movedLevel([-40, 0, 40], 2, 400, [-100, 100]), 100);
  assert.equal(movedLevel([-40, 0, 40], 2, 0.2, [-100, 100]), 40);
});

test("the plan shows all levels and no more than the bench allows", () => {
  assert.deepEqual(shownRange([-40, 40], [-40, 40], [-400, 400]), [-60, 60]);
  assert.deepEqual(shownRange([20, 60], [20, 60], [15, 62]), [15, 62]);
});
