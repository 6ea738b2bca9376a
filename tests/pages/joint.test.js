// What several recordings say together, and which error a version has on one of them.

import assert from "node:assert/strict";
import { test } from "node:test";

import { errorOn } from "../../labctl/web/static/js/explore/ladder_error.js";
import { deviationTexts } from "../../labctl/web/static/js/joint/deviation.js";

const STEP = { applied_rms_dps: null, recording: 5, recordings: [5], rms_dps: 0.00102 };

test("the RMS of a fit to several recordings is not shown as the error on one of them", () => {
  assert.equal(errorOn(5, STEP), 0.00102);
  assert.equal(errorOn(4, STEP), null);
  assert.equal(errorOn(5, { ...STEP, recordings: [4, 5] }), null);
  assert.equal(errorOn(5, { ...STEP, recordings: [4, 5], applied_rms_dps: 0.00113 }), 0.00113);
});

test("a standard deviation is written to the place of its uncertainty", () => {
  const shift = { value: 0.000003, u: 0.0000063, unit: "1", term: "scale factor repeatability, day to day" };
  assert.deepEqual(deviationTexts(shift), ["3.0 ppm", "6.3 ppm"]);
  const bias = { value: 0.00086, u: 0.0017, unit: "deg/s", term: "bias repeatability, turn-on to turn-on" };
  assert.deepEqual(deviationTexts(bias), ["0.0009 deg/s", "0.0017 deg/s"]);
});
