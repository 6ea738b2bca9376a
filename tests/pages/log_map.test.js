// The column map of a log: which column takes what, and its changes.

import assert from "node:assert/strict";
import { test } from "node:test";

import { isLog } from "../../labctl/web/static/js/recordings/file_input.js";
import { entryOf, withFact, withKey, withTarget, withUnit } from "../../labctl/web/static/js/recordings/log_map.js";

const MAP = { serial: "A", columns: { gyro_x: { from: "Gx", unit: "deg/s" }, t_s: { from: 3, unit: "ms" } } };

test("a column of the file is found by its name or its number", () => {
  assert.equal(entryOf(MAP, "Gx", 1)?.[0], "gyro_x");
  assert.equal(entryOf(MAP, "Time", 3)?.[0], "t_s");
  assert.equal(entryOf(MAP, "Gy", 2), null);
});

test("another use of a column takes it from what had it, and keeps its unit within a quantity", () => {
  assert.deepEqual(withTarget(MAP, "Gx", 1, "gyro_y").columns, {
    t_s: { from: 3, unit: "ms" },
    gyro_y: { from: "Gx", unit: "deg/s" },
  });
  assert.deepEqual(withTarget(MAP, "Gy", 2, "gyro_x").columns, {
    t_s: { from: 3, unit: "ms" },
    gyro_x: { from: "Gy" },
  });
  assert.deepEqual(withTarget(MAP, "Gx", 1, "").columns, { t_s: { from: 3, unit: "ms" } });
});

test("a scale goes with words of a converter alone", () => {
  const words = withUnit(MAP, "gyro_x", "LSB", 131);
  assert.deepEqual(words.columns.gyro_x, { from: "Gx", unit: "LSB", scale: 131 });
  assert.deepEqual(withUnit(words, "gyro_x", "rad/s", null).columns.gyro_x, { from: "Gx", unit: "rad/s" });
  assert.deepEqual(withUnit(MAP, "gyro_x", "", null).columns.gyro_x, { from: "Gx" });
});

test("an empty value leaves its key out", () => {
  assert.deepEqual(withKey(MAP, "serial", ""), { columns: MAP.columns });
  assert.equal(withKey(MAP, "motion", "rest").motion, "rest");
});

test("one file that is no recording.toml is a log", () => {
  assert.equal(isLog([{ name: "flight.csv" }]), true);
  assert.equal(isLog([{ name: "recording.toml" }]), false);
  assert.equal(isLog([{ name: "recording.toml" }, { name: "points.csv" }]), false);
});

test("facts of the unit are further keys of recording.toml, and none is left empty", () => {
  const stated = withFact(withFact(MAP, "technology", "fog"), "model", "DSP-3000");
  assert.deepEqual(stated.info, { technology: "fog", model: "DSP-3000" });
  assert.deepEqual(withFact(stated, "model", "").info, { technology: "fog" });
  assert.deepEqual(withFact(withFact(stated, "model", ""), "technology", ""), MAP);
});
