// The import of a log without the readings that were chosen: what the page sends, with fetch in place of the service.

import assert from "node:assert/strict";
import { afterEach, beforeEach, test } from "node:test";

import { sendFile } from "../../labctl/web/static/js/core/http/api.js";
import { choose, leaveOutChoices } from "../../labctl/web/static/js/recordings/leave_out.js";
import { logFields } from "../../labctl/web/static/js/recordings/log_map.js";

const { fetch, sessionStorage } = globalThis;
beforeEach(() => {
  Object.defineProperty(globalThis, "sessionStorage", { value: { getItem: () => null }, configurable: true });
});
afterEach(() => {
  globalThis.fetch = fetch;
  Object.defineProperty(globalThis, "sessionStorage", { value: sessionStorage, configurable: true });
});

/**
 * Send a log as the page does; returns the address and the form that the service would get.
 * @param {Set<string>} leaveOut
 */
async function sent(leaveOut) {
  /** @type {{ path: string, form: FormData }[]} */
  const requests = [];
  globalThis.fetch = async (path, init) => {
    requests.push({ path: String(path), form: /** @type {FormData} */ (init?.body) });
    return new Response("{}", { status: 201, headers: { "Content-Type": "application/json" } });
  };
  const file = new File(["time_s,gyro_z_dps\n0,0.1\n"], "worn.csv", { lastModified: 7 });
  const map = { serial: "W-1", columns: { gyro_z: { from: "gyro_z_dps" } } };
  await sendFile("/api/recordings/logs", file, logFields(map, { modified_ms: 7, options: ["a=1"], leaveOut }));
  assert.equal(requests.length, 1);
  return requests[0];
}

test("what was chosen is sent, one field for each kind, and nothing else", async () => {
  const warnings = ["spikes", "gaps", "time_back", "thermometer"].map((what) => ({
    what,
    n: 3,
    may_leave_out: what !== "gaps",
  }));
  const offered = leaveOutChoices(warnings, 400).map(({ kind }) => kind);
  assert.deepEqual(offered, ["spikes", "time_back", "thermometer"]);
  /** @type {Set<string>} */
  const chosen = new Set();
  const again = offered.map((kind) => choose(chosen, kind, true));
  assert.deepEqual(again, [false, true, false]);
  choose(chosen, "thermometer", false);
  const { path, form } = await sent(chosen);
  assert.ok(path.endsWith("/api/recordings/logs"));
  assert.deepEqual(form.getAll("leave_out"), ["spikes", "time_back"]);
  assert.deepEqual(form.getAll("option"), ["a=1"]);
  assert.equal(form.get("modified_ms"), "7");
  assert.equal(JSON.parse(String(form.get("column_map"))).serial, "W-1");
  assert.equal(/** @type {File} */ (form.get("file")).name, "worn.csv");
});

test("without a choice nothing is left out", async () => {
  const { form } = await sent(new Set());
  assert.deepEqual(form.getAll("leave_out"), []);
  assert.equal(logFields(null, { modified_ms: 7, options: [], leaveOut: [] }).column_map, "");
});
