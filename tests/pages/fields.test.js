// What a form says of a request that was refused, and names of persons on a page.

import assert from "node:assert/strict";
import { test } from "node:test";

import { inLabels } from "../../labctl/web/static/js/core/fields.js";
import { personText } from "../../labctl/web/static/js/core/format.js";

const fields = [
  { name: "by", label: "Who" },
  { name: "due_days", label: "Due again in days" },
];

test("a refusal names a field of the form by its label", () => {
  assert.equal(inLabels("body.by: it is blank, body.due_days: -5.", fields), "Who: it is blank, Due again in days: -5");
  assert.equal(inLabels("body.order.by: it is blank", fields), "body.order.by: it is blank"); // of no field here
});

test("a name that is longer than a line is cut, and another is not", () => {
  assert.equal(personText("A. Person"), "A. Person");
  assert.equal(personText("x".repeat(120)), "x".repeat(120));
  assert.equal(personText("x".repeat(5000)), `${"x".repeat(120)}…`);
});
