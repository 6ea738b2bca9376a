// The form of a certificate: it asks for what the measurement does not state, and checks the entries in words.

import assert from "node:assert/strict";
import { test } from "node:test";

import { fieldAt, fieldsFor, orderOf, problemsOf, unstatable } from "../../labctl/web/static/js/unit/order_fields.js";

/** @import { MissingFact } from "../../labctl/web/types/api.js" */

/**
 * @param {MissingFact["table"]} table
 * @param {string} key
 * @returns {MissingFact}
 */
const missing = (table, key) => ({ fact: `${table} ${key}`, where: "", table, key, remedy: table ? "" : "Measure." });
const ORDERED = [missing("customer", "name"), missing("item", "condition")];

/** @param {readonly MissingFact[]} facts */
const namesFor = (facts) => fieldsFor(facts).map(({ name }) => name);

const GIVEN = {
  by: "I. Issuer",
  name: "Vehicle Works",
  street: "Track 1",
  post_code: "ME1 1AA",
  city: "Rochester",
  country: "gb",
  email: "r.driver@example.org",
  manufacturer: "KVH",
  condition: "No visible damage.",
};

test("each missing fact that a table of the order can state has a field", () => {
  assert.ok(!namesFor(ORDERED).includes("method_name"));
  const facts = [...ORDERED, missing("method", "name"), missing("method", "performed_until")];
  assert.deepEqual(namesFor(facts).slice(0, 3), ["method_name", "performed_until", "by"]);
  assert.equal(namesFor([missing("laboratory", "city")]).filter((name) => name.startsWith("laboratory_")).length, 6);
  assert.deepEqual(unstatable(facts), []);
});

test("what no field states is told apart", () => {
  const standards = missing(null, "");
  const unknown = missing("accelerometer", "traceability");
  assert.deepEqual(unstatable([...ORDERED, standards, unknown]), [standards, unknown]);
});

test("entries are checked in words, and a country is made upper-case", () => {
  const fields = fieldsFor(ORDERED);
  assert.deepEqual(problemsOf(fields, GIVEN), {});
  assert.equal(orderOf(GIVEN).customer.country, "GB");
  const found = problemsOf(fields, { ...GIVEN, country: "Germany", name: "a".repeat(5000), condition: " " });
  assert.deepEqual(Object.keys(found), ["name", "country", "condition"]);
  assert.match(found.country, /two letters/);
  assert.match(found.name, /5000 characters; shorten it to 300/);
});

test("a limit is a number above 0, and stands with its specification", () => {
  const fields = fieldsFor(ORDERED);
  /** @param {string} limit_dps */
  const said = (limit_dps, specification = "VW-77") =>
    problemsOf(fields, { ...GIVEN, specification, limit_dps }).limit_dps;
  for (const text of ["abc", "0,1"]) assert.match(said(text), /a number with a point, such as 0\.1/);
  assert.match(said("-1"), /above 0/);
  assert.match(said(""), /State the limit/);
  assert.match(said("0.1", ""), /State the specification/);
  assert.equal(said("0.1"), undefined);
});

test("the last day of the measurements is not before the first", () => {
  const fields = fieldsFor([missing("method", "performed_from"), missing("method", "performed_until")]);
  const found = problemsOf(fields, { ...GIVEN, performed_from: "2026-01-05", performed_until: "2026-01-04" });
  assert.deepEqual(Object.keys(found), ["performed_until"]);
});

test("the field of a place in the request is known by its path", () => {
  assert.equal(fieldAt("order.customer.country"), "country");
  assert.equal(fieldAt("order.item.received"), "received");
  assert.equal(fieldAt("order.state_due"), undefined);
});
