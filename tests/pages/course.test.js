import assert from "node:assert/strict";
import test from "node:test";

import {
  indexAt,
  readingsAt,
  soakCourse,
  soaksOf,
  stepAt,
} from "../../labctl/web/static/js/campaigns/course_numbers.js";

const STEPS = /** @type {any} */ ({
  number: [1, 2, 3, 4],
  kind: ["soak", "acquire", "soak", "acquire"],
  started_s: [0, 100, 130, null],
  ended_s: [90, 120, null, null],
  temperature_c: [20, 20, 50, 50],
  rate_dps: [null, -40, null, 40],
  dataset: [null, 1, null, 2],
});
const COURSE = {
  campaign: 1,
  samples: 5,
  t_s: [0, 60, 110, 130, 190],
  chamber_c: [25, 21, 20, 20, 44],
  setpoint_c: [20, 20, 20, 50, null],
  units_c: { A: [25, 23, 22, 22, null] },
};
const SETS = /** @type {any} */ ({
  recording: 1,
  number: [1],
  state: ["complete"],
  channels: { gyro_z: { mean: [-39.987654321], std: [0.1] }, temperature_c: { mean: [22], std: [0] } },
  output: { z: { unit: "V" } },
});

test("a time belongs to the last sample before it and to the step that ran", () => {
  assert.deepEqual(
    [-1, 0, 59, 60, 500].map((t) => indexAt(COURSE.t_s, t)),
    [0, 0, 0, 1, 4],
  );
  assert.deepEqual(
    [0, 95, 110, 1000].map((t) => stepAt(STEPS, t)),
    [0, null, 1, 2],
  );
});

test("readings of one time are those of chamber, unit, step and data set", () => {
  const rows = Object.fromEntries(readingsAt({ course: COURSE, steps: STEPS, datasets: SETS }, 115));
  assert.equal(rows.Step, "2: acquire");
  assert.equal(rows.Chamber, "20.00 °C");
  assert.equal(rows.A, "22.00 °C");
  assert.equal(rows["Table rate"], "−40 deg/s");
  assert.equal(rows["Data set"], "1: complete");
  assert.equal(rows["gyro z"], "−39.98765 V");
  assert.equal(
    Object.fromEntries(readingsAt({ course: COURSE, steps: STEPS, datasets: null }, 95)).Step,
    "between two steps",
  );
});

test("a soak is drawn against its own beginning and set point", () => {
  const soaks = soaksOf(STEPS);
  assert.deepEqual(
    soaks.map((soak) => soak.number),
    [1, 3],
  );
  assert.deepEqual(soakCourse(COURSE, COURSE.chamber_c, soaks[0]), { x: [0, 1], y: [5, 1] });
  assert.deepEqual(soakCourse(COURSE, COURSE.chamber_c, soaks[1]), { x: [0, 1], y: [-30, -6] });
  assert.deepEqual(soakCourse(COURSE, COURSE.units_c.A, soaks[1]).y, [-28, null]);
});
