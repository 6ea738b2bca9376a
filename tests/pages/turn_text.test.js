// A turn by hand in words.

import assert from "node:assert/strict";
import { test } from "node:test";
import { turnText } from "../../labctl/web/static/js/bench/turn_text.js";

/** @type {Parameters<typeof turnText>[0]} */
const turn = { phase: "turn", position: "-x", asked_deg: -720, attempt: 1, came_deg: {} };

test("what is asked, and what has come out so far", () => {
  assert.deepEqual(turnText(turn), { text: "−720 deg about -x, clockwise.", share: 0 });
  assert.deepEqual(turnText({ ...turn, came_deg: { imu: -360.4 } }), {
    text: "−360 deg of −720 deg about -x, clockwise.",
    share: 360.4 / 720,
  });
});

test("an angle beyond what is asked, or the other way, leaves the bar in its bounds", () => {
  assert.equal(turnText({ ...turn, came_deg: { imu: -900 } }).share, 1);
  assert.equal(turnText({ ...turn, came_deg: { imu: 300 } }).share, 0);
});

test("a rest, and a further attempt, are said", () => {
  assert.equal(
    turnText({ ...turn, phase: "rest", attempt: 2 }).text,
    "Keep the unit still, axis -x pointing up (attempt 2).",
  );
});
