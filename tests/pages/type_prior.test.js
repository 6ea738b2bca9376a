// What a version says of where its coefficients are from.

import assert from "node:assert/strict";
import { test } from "node:test";

import { priorText } from "../../labctl/web/static/js/unit/type_prior.js";

const PRIOR = {
  type: "KVH E-Core",
  model: "bias_scale",
  units: 10,
  left_out: 0,
  is_used: true,
  p_value: 0.9648,
  versions_hash: "6a",
};

test("a version says that other units are in its coefficients, or that it is unlike them", () => {
  assert.match(priorText(PRIOR), /also contain what 10 other units of type KVH E-Core by model bias_scale say/);
  assert.match(priorText(PRIOR), /a probability of 0\.96\.$/);
  assert.match(priorText({ ...PRIOR, is_used: false, p_value: 0.0012 }), /is unlike the.*p = 0\.0012.*fitted alone/);
});
