// When a page says that the bench is not stopped.

import assert from "node:assert/strict";
import { test } from "node:test";

import { LATE_MS, confirms, notStopped } from "../../labctl/web/static/js/core/stop/state.js";

const NOTHING = { asked_ms: null, trouble: "", reported: "" };

test("nothing is shown while no stop is asked for, and in the first moments of one", () => {
  assert.equal(notStopped(NOTHING), null);
  assert.equal(notStopped({ ...NOTHING, asked_ms: LATE_MS - 1 }), null);
});

test("a stop that fails or is late is said to have failed, in words for a person at a table", () => {
  for (const known of [
    { ...NOTHING, asked_ms: 10, trouble: "The service does not answer." },
    { ...NOTHING, asked_ms: LATE_MS + 1 },
    { ...NOTHING, reported: "bench b: table to rest: no answer" },
  ])
    assert.equal(notStopped(known)?.title, "NOT STOPPED. Use the stop switch.");
  assert.equal(notStopped({ ...NOTHING, asked_ms: 10, trouble: "no answer" })?.text, "no answer");
});

test("a campaign that has ended confirms a stop, and the page in place of the service does", () => {
  assert.ok(confirms({ ended: true }));
  assert.ok(confirms({ stands: true }));
  assert.ok(!confirms({ ended: false }));
  assert.ok(!confirms({ stands: false }));
});
