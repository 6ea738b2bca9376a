import assert from "node:assert/strict";
import test from "node:test";

import { axisOf, pointsOf } from "../../labctl/web/static/js/campaigns/uncertainty_numbers.js";

/** @type {import("../../labctl/web/types/api.js").UncertaintyCourse} */
const ANSWER = {
  campaign: 1,
  target_u_dps: 0.003,
  planned: 20,
  units: {
    imu: {
      datasets: [2, 4, 6, 8, 10],
      t_s: [100, 200, 300, 400, 500],
      u_dps: [null, 0.5, 0.01, 0.004, 0.0029],
      known: ["unknown", "at least", "at least", "of the fit", "of the fit"],
    },
  },
};

test("U of the fit and its lower bound are separate points, and what is unknown is none", () => {
  assert.deepEqual(pointsOf(ANSWER.units.imu, "of the fit"), { x: [8, 10], y: [0.004, 0.0029] });
  assert.deepEqual(pointsOf(ANSWER.units.imu, "at least"), { x: [4, 6], y: [0.5, 0.01] });
});

test("the axis has all data sets of the plan, also where more were taken", () => {
  assert.deepEqual(axisOf(ANSWER), [0, 20]);
  assert.deepEqual(axisOf({ ...ANSWER, planned: 6 }), [0, 10]);
  assert.deepEqual(axisOf({ ...ANSWER, planned: 0, units: {} }), [0, 1]);
});
