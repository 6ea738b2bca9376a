// When a page asks again for what the service could not answer.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Problem, Unreachable } from "../../labctl/web/static/js/core/http/errors.js";
import { waitOf } from "../../labctl/web/static/js/core/http/recovery.js";

/**
 * @param {number} status
 * @param {number} [retry_after_s]
 */
const problem = (status, retry_after_s) =>
  new Problem({ type: "about:blank", title: "No", status, detail: "no" }, retry_after_s);

test("what passes by itself is asked for again, when the service says or after a moment", () => {
  assert.equal(waitOf(new Unreachable()), 0);
  for (const status of [429, 502, 503, 504]) assert.equal(waitOf(problem(status)), 3);
  assert.equal(waitOf(problem(503, 7)), 7);
  assert.equal(waitOf(problem(503, 3600)), 30);
});

test("what does not pass by itself is not asked for again", () => {
  for (const status of [400, 401, 404, 409, 422, 500]) assert.equal(waitOf(problem(status)), null);
  assert.equal(waitOf(new TypeError("a fault of the page")), null);
});
