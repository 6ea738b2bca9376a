// A check of the bench in words.

import assert from "node:assert/strict";
import { test } from "node:test";
import { summaryOf } from "../../labctl/web/static/js/bench/check_text.js";

/** @param {...("good" | "doubtful" | "bad")} states */
const check = (...states) =>
  /** @type {Parameters<typeof summaryOf>[0]} */ (
    /** @type {unknown} */ ({ devices: [{ findings: states.map((state) => ({ state })) }] })
  );

test("what is wrong and what is doubtful is counted over all instruments", () => {
  assert.equal(summaryOf(check("good", "good")), "1 instrument, nothing is wrong.");
  assert.equal(summaryOf(check("good", "bad", "doubtful", "bad")), "1 instrument: 2 wrong, 1 doubtful.");
});
