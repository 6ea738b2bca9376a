// When a page says that the bench is not stopped.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  LATE_MS,
  confirms,
  notStopped,
  remembered,
  tableUnknown,
  troubleOf,
} from "../../labctl/web/static/js/core/stop/state.js";

const NOTHING = { asked_ms: null, shown: false, trouble: "", reported: "", left: "" };

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

test("what was said once of a stop is said until it is confirmed", () => {
  assert.ok(notStopped({ ...NOTHING, asked_ms: 10, shown: true }));
  assert.equal(notStopped({ ...NOTHING, shown: true }), null);
});

test("a campaign that has ended confirms a stop, and the page in place of the service does", () => {
  assert.ok(confirms({ ended: true }));
  assert.ok(confirms({ stands: true }));
  assert.ok(!confirms({ ended: false }));
  assert.ok(!confirms({ stands: false }));
});

test("an ended campaign whose table is not known to stand is not stopped, and a silent chamber is something else", () => {
  assert.ok(notStopped({ ...NOTHING, left: "table to rest: no answer" }));
  for (const unconfirmed of [
    "table to rest: no answer",
    "chamber to its safe set point: no; table to rest: no",
    "COM3",
  ])
    assert.ok(tableUnknown({ unconfirmed }), unconfirmed);
  for (const bench of [
    {},
    { unconfirmed: "" },
    { unconfirmed: "chamber to its safe set point: no answer" },
    { unconfirmed: "stream of FOG-1 closed: no answer" },
    { unconfirmed: "table to rest: no answer", confirmed_at: "2026-01-05T08:00:00Z" },
  ])
    assert.ok(!tableUnknown(bench), JSON.stringify(bench));
});

test("why a stop failed is said once, without what the title says already", () => {
  assert.match(troubleOf({ detail: "Failed to fetch" }), /^labctl does not answer\. .* again/);
  assert.match(troubleOf({ status: 401, detail: "needs a key" }), /^labctl refuses the stop: needs a key$/);
  const late = "NOT STOPPED: table to rest: no answer. Use the stop switch of the bench.";
  assert.match(troubleOf({ status: 503, detail: late }), /^labctl answers: table to rest: no answer\. The stop/);
});

test("a stop is asked for again by the next page, but not a day later", () => {
  const stored = JSON.stringify({ campaign: 3, body: { reason: "smoke" }, at_ms: 1000 });
  assert.equal(remembered(stored, 2000)?.campaign, 3);
  assert.equal(remembered(stored, 86_400_000), null);
  assert.equal(remembered(null, 0), null);
});
