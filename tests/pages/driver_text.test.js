// Which service drives each of the other benches.

import assert from "node:assert/strict";
import { test } from "node:test";
import { otherBenches } from "../../labctl/web/static/js/bench/driver_text.js";

/** @import { BenchStatus } from "../../labctl/web/types/api.js" */

const SEEN = { last_used_at: "2026-01-05T08:00:00Z", unconfirmed: "", attempts: 0 };

/**
 * @param {string} name
 * @param {boolean | null} alive
 * @returns {BenchStatus}
 */
function bench(name, alive) {
  const text = alive ? "the service at http://b:8420 drives the bench" : "the service at http://b:8420 is gone";
  const process = {
    url: "http://b:8420",
    host: "b",
    pid: 7,
    since: SEEN.last_used_at,
    last_sign_at: SEEN.last_used_at,
  };
  const driver = alive === null ? null : { ...process, alive, text };
  return { ...SEEN, name, left: [], unconfirmed_at: null, attempted_at: null, confirmed_at: null, stop: null, driver };
}

test("each bench but this one has a line, and a service that is gone is a fault", () => {
  assert.deepEqual(otherBenches([bench("a", true), bench("b", true), bench("c", false), bench("d", null)], "a"), [
    { name: "b", text: "the service at http://b:8420 drives the bench", isFault: false },
    { name: "c", text: "the service at http://b:8420 is gone", isFault: true },
    { name: "d", text: "no service drives the bench", isFault: false },
  ]);
});

test("a database that no other service writes to has no such lines", () => {
  assert.deepEqual(otherBenches([bench("a", true), bench("b", null)], "a"), []);
});
