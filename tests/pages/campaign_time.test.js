import assert from "node:assert/strict";
import test from "node:test";

import { hindrances, planNote } from "../../labctl/web/static/js/campaigns/campaign_time.js";

test("a busy computer and repeated data sets are said", () => {
  assert.deepEqual(hindrances({ repeated: 0, stalled_s: 0 }), []);
  assert.deepEqual(hindrances({ repeated: 1, stalled_s: 1.34 }), [
    "1 data set was taken again.",
    "The computer of the bench did not run labctl for 1.3 s.",
  ]);
  assert.deepEqual(hindrances({ repeated: 3, stalled_s: 0 }), ["3 data sets were taken again."]);
});

test("the planned duration of an ended campaign is not called as planned", () => {
  assert.equal(planNote({ ended_at: null }), "without interruptions");
  assert.match(planNote({ ended_at: "2026-01-05T09:00:00Z" }), /^computed before the start/);
});
