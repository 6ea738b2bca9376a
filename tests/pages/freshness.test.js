// How fresh a page is, and the words for it.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  ago,
  BENCH_STALE_S,
  freshnessWords,
  readOnlyWords,
  STALE_MS,
  stalenessOf,
} from "../../labctl/web/static/js/core/freshness/state.js";

/** @import { Heard } from "../../labctl/web/static/js/core/freshness/state.js" */

/** @type {Heard} */
const fresh = { service_s: 0.4, open_s: 60, bench_s: 1.2, paused: false, trouble: "", clock: "12:00:00" };
/** @param {Partial<Heard>} change */
const words = (change) => {
  const heard = { ...fresh, ...change };
  const found = stalenessOf(heard);
  return { found, ...freshnessWords(found, heard) };
};

test("a page that hears service and bench is fresh", () => {
  assert.deepEqual(words({}), {
    found: "no",
    stale: false,
    text: "Last answer of the service 0 s ago, bench 1 s ago.",
  });
  assert.equal(words({ bench_s: null }).text, "Last answer of the service 0 s ago.");
});

test("it is stale once the service was not heard for long enough", () => {
  assert.equal(words({ service_s: STALE_MS / 1000 }).found, "no");
  const { found, stale, text } = words({ service_s: STALE_MS / 1000 + 0.1 });
  assert.deepEqual([found, stale], ["yes", true]);
  assert.equal(
    text,
    "Last answer of the service 4 s ago. The values on this page may be out of date; they date from 12:00:00.",
  );
});

test("a page that has just been opened asks first", () => {
  const opened = { service_s: null, bench_s: null, clock: null };
  assert.equal(words({ ...opened, open_s: 1 }).text, "Asking the service …");
  assert.deepEqual(words({ ...opened, open_s: 5 }), {
    found: "yes",
    stale: true,
    text: "The service has not answered. The values on this page may be out of date.",
  });
});

test("a silent bench, an answer that does not fit and a hidden tab each say what is known", () => {
  assert.match(
    words({ bench_s: BENCH_STALE_S + 0.1 }).text,
    /^Last answer of the bench 3 s ago; the service answers\./,
  );
  assert.equal(words({ trouble: "no such path" }).found, "trouble");
  assert.match(words({ trouble: "no such path" }).text, /: no such path$/);
  assert.match(words({ paused: true }).text, /last answer of the service at 12:00:00\.$/);
  assert.match(words({ paused: true, clock: null }).text, /last answer of the service never\.$/);
});

test("two minutes and more are in minutes", () => {
  assert.equal(ago(119.9), "119 s ago");
  assert.equal(ago(120), "2 min ago");
});

test("a service that only reads says so, and how old the data of a replica are", () => {
  assert.equal(readOnlyWords({}), "");
  assert.equal(readOnlyWords({ read_only: true, replica: null }), "This service only reads.");
  /** @param {number | null} age_s */
  const words = (age_s, is_connected = true) => readOnlyWords({ read_only: true, replica: { age_s, is_connected } });
  assert.equal(words(3.2), "This service only reads: the data are those of a replica, not older than 4 s.");
  assert.match(words(150), /not older than 3 min\.$/);
  assert.match(words(7300), /not older than 3 h\.$/);
  assert.match(words(null), /of unknown age\.$/);
  assert.match(words(60, false), /a replica, which is not connected to its server now, not older than 60 s\.$/);
});
