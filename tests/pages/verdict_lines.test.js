// The order of a verdict's sentences: a doubt of the data is no headline, data that are wrong are.

import assert from "node:assert/strict";
import { test } from "node:test";

import { verdictLines } from "../../labctl/web/static/js/explore/verdict_lines.js";

/** @param {("certain" | "likely")[]} severities */
const criticism = (...severities) =>
  /** @type {any} */ ({
    warnings: severities.map((severity) => ({ severity })),
    text: [...severities, "One of these effects is missing.", "To distinguish them: rates.", "In another card."],
  });

test("what is only to be checked follows the verdict", () => {
  assert.deepEqual(verdictLines(criticism("likely"), new Set(["In another card."])), {
    first: ["One of these effects is missing."],
    doubts: ["likely"],
    others: ["To distinguish them: rates."],
  });
});

test("what makes a verdict void stands before it", () => {
  const { first, doubts, others } = verdictLines(criticism("certain", "likely"));
  assert.deepEqual(first, ["certain", "One of these effects is missing."]);
  assert.deepEqual(doubts, ["likely"]);
  assert.equal(others.length, 2);
});
