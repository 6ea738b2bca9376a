import assert from "node:assert/strict";
import test from "node:test";

import {
  ageText,
  alarmText,
  distanceText,
  levelOf,
  limitText,
  usedShare,
  valueText,
} from "../../labctl/web/static/js/bench/limit_numbers.js";
import { needsPerson } from "../../labctl/web/static/js/bench/wall_view.js";

const AIR = {
  kind: "chamber_limits",
  device: "chamber",
  title: "air, limits of the chamber",
  value: 20,
  low: -42,
  high: 102,
  unit: "deg C",
  action: "fail",
  is_beyond: false,
  age_s: 0.42,
};
const SILENT = { ...AIR, kind: "stale", device: "imu", title: "silent", value: 27, low: null, high: 30, unit: "s" };

test("a strip says reading, limit, distance and age", () => {
  assert.equal(valueText(AIR), "20.0 deg C");
  assert.equal(limitText(AIR), "−42 to 102 deg C");
  assert.equal(distanceText(AIR), "62.0 K left");
  assert.equal(ageText(AIR), "0.4 s old");
  assert.equal(limitText(SILENT), "at most 30 s");
  assert.equal(distanceText(SILENT), "3.00 s left");
});

test("a strip is amber from four fifths of the way to its limit, and red beyond it", () => {
  assert.equal(levelOf(AIR), "good");
  assert.equal(levelOf({ ...AIR, value: 87.61 }), "warn"); // 30 + 0.8 of 72
  assert.equal(levelOf({ ...AIR, value: 87.5 }), "good");
  assert.equal(levelOf({ ...AIR, value: -27.61 }), "warn");
  assert.equal(levelOf(SILENT), "warn");
  assert.equal(levelOf({ ...SILENT, value: 31, is_beyond: true }), "bad");
  assert.equal(distanceText({ ...SILENT, value: 31, is_beyond: true }), "1.00 s beyond");
  assert.equal(usedShare({ ...AIR, value: 102 }), 1);
});

test("a number of things has no distance; a single reading beyond a share is no trend", () => {
  const alarms = { ...AIR, title: "alarms", value: 0, low: null, high: 0, unit: "" };
  assert.equal(usedShare(alarms), 0);
  assert.equal(distanceText(alarms), "none");
  assert.equal(limitText(alarms), "none allowed");
  assert.equal(distanceText({ ...alarms, value: 1, is_beyond: true }), "beyond its limit");
  const share = { ...AIR, value: 10, low: null, high: 2, unit: "%" };
  assert.equal(levelOf(share), "warn");
  assert.equal(distanceText(share), "a single reading");
});

test("of a table that is to stand no motion is allowed", () => {
  const still = {
    ...AIR,
    kind: "rate",
    device: "table",
    title: "motion while at rest",
    low: null,
    high: 0,
    unit: "deg/s",
  };
  assert.equal(limitText({ ...still, value: 0 }), "none allowed");
  assert.equal(distanceText({ ...still, value: 0 }), "none");
  assert.equal(levelOf({ ...still, value: 0 }), "good");
  const moves = { ...still, value: 0.01, is_beyond: true };
  assert.equal(valueText(moves), "0.01 deg/s");
  assert.equal(distanceText(moves), "0.01 deg/s beyond");
  assert.equal(levelOf(moves), "bad");
});

test("the tab and the sound say what needs a person", () => {
  const now = { limits: [AIR], prompt: null, state: "running" };
  assert.equal(alarmText(now.limits), "");
  assert.equal(needsPerson(now, false), "");
  assert.equal(needsPerson(now, true), "the values may be out of date");
  const beyond = { ...now, limits: [{ ...AIR, value: 110, is_beyond: true }] };
  assert.equal(alarmText(beyond.limits), "LIMIT chamber");
  assert.equal(needsPerson(beyond, false), "a limit is passed");
  assert.equal(needsPerson({ ...now, prompt: { id: "1" } }, false), "a question waits for an answer");
  assert.equal(needsPerson({ ...now, state: "paused" }, false), "the campaign is paused");
});
