// Many units: what a brush selects, and the bars of a type.

import assert from "node:assert/strict";
import { test } from "node:test";

import { brushed } from "../../labctl/web/static/js/fleet/brushed.js";
import { jobText, progressText } from "../../labctl/web/static/js/fleet/jobs.js";

/**
 * @param {string} level
 * @param {string} at
 * @param {number} units
 * @param {number} mean
 */
const point = (level, at, units, mean) => ({ level, at, units, mean, low: mean, high: mean, mean_u: null });
const POINTS = [
  point("B1", "2026-01-05T08:00:00Z", 2, 1),
  point("B2", "2026-01-05T08:00:00Z", 2, 1.2),
  point("B2", "2026-02-05T08:00:00Z", 6, 1.4),
  point("", "2026-03-05T23:59:00Z", 10, 3),
];

test("a brush lists the groups inside with the mean of their units there, the farthest from the others first", () => {
  const found = brushed(POINTS, "2026-02-01", "2026-03-05");
  assert.deepEqual(
    found.map(({ level, units, mean }) => [level, units, mean.toFixed(6)]),
    [
      ["", 10, "3.000000"],
      ["B2", 6, "1.400000"],
    ],
  );
  assert.equal(found[0].off?.toFixed(3), (3 - (2 + 2.4 + 8.4) / 10).toFixed(3));
});

test("without limits all groups are listed, each once", () => {
  assert.deepEqual(
    brushed(POINTS, "", "")
      .map(({ level, units }) => [level, units])
      .sort(),
    [
      ["", 10],
      ["B1", 2],
      ["B2", 8],
    ],
  );
  assert.deepEqual(brushed(POINTS, "2027-01-01", ""), []);
});

test("a group without others beside it differs from nothing, and not by 0", () => {
  assert.deepEqual(
    brushed(POINTS.slice(0, 1), "", "").map(({ level, off }) => [level, off]),
    [["B1", null]],
  );
});

const REQUEST = {
  accept_warnings: false,
  again: false,
  batch: "",
  effects: /** @type {string[]} */ ([]),
  engine: "local",
  kind: /** @type {const} */ ("fit"),
  model: "",
  search: "",
  source: "",
  supplier: "",
  type: "",
};

test("a job is what it does and of which units", () => {
  assert.deepEqual(jobText({ kind: "criticise", request: REQUEST }), ["Criticise", "all units"]);
  assert.deepEqual(
    jobText({ kind: "fit", request: { ...REQUEST, model: "cubic", effects: ["lag"], type: "FOG-A", batch: "B2" } }),
    ["Fit cubic + lag", "FOG-A, batch B2"],
  );
  assert.deepEqual(jobText({ kind: "criticise", request: { ...REQUEST, supplier: "Acme", search: "7" } }), [
    "Criticise",
    "from Acme, “7”",
  ]);
});

test("the finished units are those that do not wait, and the others are told apart", () => {
  assert.equal(progressText({ units: 2000, waiting: 1990, failed: 0, skipped: 0 }), "10 of 2,000");
  assert.equal(progressText({ units: 30, waiting: 0, failed: 2, skipped: 4 }), "30 of 30, 4 skipped, 2 failed");
});
