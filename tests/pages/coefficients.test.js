// Coefficients of two versions beside each other, where one has them over temperature and the other one value each.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  columnsBeside,
  correlatedText,
  differenceOf,
  differenceText,
  nominalText,
  termsText,
} from "../../labctl/web/static/js/unit/coefficient_table.js";

/** @param {Record<string, unknown>} coefficients */
const version = (coefficients) => /** @type {any} */ ({ axes: { x: { coefficients } } });
const OTHERS = [
  { axis: "x", name: "bias", temperature_c: [0, 40], value: [0.1, 0.2], u: [0.01, 0.01], unit: "deg/s" },
  { axis: "y", name: "bias", temperature_c: [0, 40], value: [0.3, 0.4], u: [0.01, 0.01], unit: "deg/s" },
];

test("a single value stands beside a column as the same value at all its temperatures", () => {
  const found = columnsBeside(version({ bias: { value: 0.15, u: 0.02, unit: "deg/s" } }), OTHERS);
  assert.deepEqual(found, [
    { axis: "x", name: "bias", temperature_c: [0, 40], value: [0.15, 0.15], u: [0.02, 0.02], unit: "deg/s" },
  ]);
});

test("columns of another version stand beside each other as they are", () => {
  const own = { temperature_c: [5, 45], bias: { value: [0.1, 0.3], u: [0.02, 0.03], unit: "deg/s" } };
  assert.deepEqual(
    columnsBeside(version(own), OTHERS).map(({ axis, value }) => [axis, value]),
    [["x", [0.1, 0.3]]],
  );
});

test("versions that differ only in how their coefficients follow the temperature are not called the same", () => {
  const table = { version: 1, effects: ["bias"], columns: true };
  const single = { version: 2, effects: ["bias"], columns: false };
  const text =
    "Versions 2 and 1 have the same effects. The coefficients of version 1 change with temperature, those of version 2 are one value each.";
  assert.equal(differenceText(single, table), text);
  assert.equal(
    differenceText(
      { ...single, effects: ["bias", "warm_up"] },
      { ...single, version: 3, effects: ["bias", "dead_band"] },
    ),
    "Version 2 has warm up more and lacks dead band than version 3.",
  );
});

test("the reference temperature and the parameters of effects are said beside the coefficients", () => {
  const term = (/** @type {string} */ effect, /** @type {Record<string, number>} */ parameters) => ({
    effect,
    parameters,
  });
  const model = { terms: [term("rate_temperature_surface", {}), term("saturation", { knee_dps: 82.86656 })] };
  const said = (/** @type {Record<string, unknown>} */ coefficients) =>
    termsText(/** @type {any} */ ({ axes: { z: { coefficients } }, model, reference_temperature_c: 36 }));
  assert.equal(said({ c_r1_t1: {} }), "T_ref is 36 °C; saturation: knee 82.87 deg/s.");
  assert.equal(said({ bias: {} }), "saturation: knee 82.87 deg/s.");
  // a law that is fitted: k is where it was tried, and the coefficients have what the fit found
  const sine = { terms: [term("sine_response", { k: 0.67, k_squared_z: 0.064 })] };
  const coefficients = { bias: {}, k: {}, k_squared: {} };
  assert.equal(termsText(/** @type {any} */ ({ axes: { z: { coefficients } }, model: sine })), "");
});

test("the nominal scale factor of each output is stated with its unit", () => {
  const output = { z: { unit: "mV", scale: -22, offset: 2500 }, x: { unit: "deg/s", scale: 1, offset: 0 } };
  const said = nominalText(/** @type {any} */ ({ output }));
  assert.ok(said.endsWith(": axis z: −22 mV per deg/s, 2500 mV at rest; axis x: 1 deg/s per deg/s, 0 deg/s at rest."));
  assert.equal(nominalText({ output: {} }), "");
});

test("coefficients of fits of the same data have no difference in u, and the text says what changed", () => {
  const fit = (/** @type {number[]} */ recordings, /** @type {string[]} */ effects) =>
    /** @type {any} */ ({ recordings, model: { effects } });
  const line = fit([1], ["bias", "scale_factor"]);
  const text = correlatedText(fit([1], ["bias", "scale_factor", "scale_factor_odd"]), line);
  assert.ok(text.startsWith("Both are fits of recording 1: their errors are correlated"));
  assert.ok(text.endsWith("the slope of a straight line."));
  assert.ok(!correlatedText(line, line).includes("another quantity"));
  assert.equal(correlatedText(line, fit([2], ["bias"])), "");
  const own = { value: -0.00127, u: 0.0003, unit: "1" };
  const beside = { value: -0.0213, u: 0.0004, unit: "1" };
  const name = "scale_factor";
  assert.equal(differenceOf(own, beside, { name, shared: false }), "40 u");
  assert.ok(differenceOf(own, beside, { name, shared: true }).endsWith(" ppm"));
  assert.equal(differenceOf(own, null, { name, shared: true }), "–");
  assert.equal(differenceOf({ ...own, u: null }, beside, { name, shared: false }), "–");
});
