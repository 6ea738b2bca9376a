// Contributions to an uncertainty: every known source is a line, and what is not stated has none.

import assert from "node:assert/strict";
import test from "node:test";

import { contributionTraces } from "../../labctl/web/static/js/unit/contribution_lines.js";

const lines = {
  at: [0, 50, 100],
  contributions: { clock: [0, 0.001, 0.002], level: [null, null, null], thermometer: [0, 0, 0] },
  combined: [0.001, 0.0015, 0.0025],
  expanded: [0.002, 0.003, 0.005],
};

test("every source that is known is drawn with its unit, also where it is 0", () => {
  const traces = contributionTraces(lines, "#000");
  assert.deepEqual(
    traces.map(({ name }) => name),
    ["clock, deg/s", "thermometer, deg/s", "combined u, deg/s", "expanded U, deg/s"],
  );
  assert.deepEqual(traces[0].y, lines.contributions.clock);
  assert.deepEqual(traces[3].x, lines.at);
});

test("a single place is a marker", () => {
  const one = { at: [0], contributions: { clock: [0.1] }, combined: [null], expanded: [null] };
  assert.deepEqual(
    contributionTraces(one, "#000").map(({ mode }) => mode),
    ["markers"],
  );
});
