// Contributions to an uncertainty: the largest known sources are lines, the others are one; what is not stated has none.

import assert from "node:assert/strict";
import test from "node:test";

import { contributionRows, contributionTraces } from "../../labctl/web/static/js/unit/contribution_lines.js";

const lines = {
  at: [0, 50, 100],
  contributions: { clock: [0, 0.001, 0.002], level: [null, null, null], thermometer: [0, 0, 0] },
  combined: [0.001, 0.0015, 0.0025],
  expanded: [0.002, 0.003, 0.005],
};

test("every source that is known is drawn, also where it is 0, the largest first", () => {
  const traces = contributionTraces(lines, "#000");
  assert.deepEqual(
    traces.map(({ name }) => name),
    ["clock", "thermometer", "combined u", "expanded U"],
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

test("where U is not known, the sources that are known have lines of their own, however small their numbers", () => {
  const unknown = {
    at: [0, 100],
    contributions: { coefficients: [0.00017, 0.0002], model: [0.0003, 0.0004], repeatability: [null, null] },
    combined: [null, null],
    expanded: [null, null],
  };
  assert.deepEqual(
    contributionTraces(unknown, "#000").map(({ name }) => name),
    ["model", "coefficients"],
  );
});

const many = {
  at: [0, 100],
  contributions: {
    model: [0.03, 0.01],
    clock: [0.001, 0.002],
    tilt: [0.002, 0.0015],
    level: [null, null],
    fixture_angle: [0, 0.04],
  },
  combined: [0.0301, 0.0413],
  expanded: [0.0602, 0.0826],
};

test("small sources are one line, the root of the sum of their squares, and have no colour of their own", () => {
  const traces = contributionTraces(many, "#000");
  assert.deepEqual(
    traces.map(({ name }) => name),
    ["model", "fixture angle", "2 others", "combined u", "expanded U"],
  );
  assert.deepEqual(traces[2].y, [Math.hypot(0.001, 0.002), Math.hypot(0.002, 0.0015)]);
});

test("a figure names four sources at most, however many are large", () => {
  const names = ["a", "b", "c", "d", "e", "f"];
  const even = {
    at: [0],
    contributions: Object.fromEntries(names.map((name) => [name, [0.01]])),
    combined: [0.02],
    expanded: [0.04],
  };
  const drawn = contributionTraces(even, "#000").map(({ name }) => name);
  assert.deepEqual(drawn, ["a", "b", "c", "d", "2 others", "combined u", "expanded U"]);
});

test("the file of a figure has every source with its unit, also those that are drawn together", () => {
  const [heading, ...rows] = contributionRows(many, "rate, deg/s");
  assert.deepEqual(heading, [
    "rate, deg/s",
    ...Object.keys(many.contributions).map((name) => `${name}, deg/s`),
    "combined u, deg/s",
    "expanded U, deg/s",
  ]);
  assert.deepEqual(rows[1], [100, 0.01, 0.002, 0.0015, null, 0.04, 0.0413, 0.0826]);
});
