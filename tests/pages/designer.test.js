import assert from "node:assert/strict";
import test from "node:test";

import { designBody } from "../../labctl/web/static/js/campaigns/designer_request.js";

test("what is empty is left to the service, and without a recipe the usual model is asked for", () => {
  assert.deepEqual(designBody({ like: "", model: "", u_dps: "0.004", hours: "" }), {
    model: "bias_scale",
    u_dps: 0.004,
  });
  assert.deepEqual(designBody({ like: "short", model: "", u_dps: "", hours: "9.5" }), { like: "short", hours: 9.5 });
  assert.deepEqual(designBody({ like: "short", model: "ojeda2000", u_dps: "1e-3", hours: "4" }), {
    like: "short",
    model: "ojeda2000",
    u_dps: 0.001,
    hours: 4,
  });
});
