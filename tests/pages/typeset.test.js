// Texts as a page writes them: signs of mathematics, not ASCII; names, dates and ranges as they are.

import assert from "node:assert/strict";
import { test } from "node:test";
import { withNames } from "../../labctl/web/static/js/core/names.js";
import { superscript, typeset } from "../../labctl/web/static/js/core/typeset.js";

test("numbers have the minus sign, plus or minus is one sign, and powers are of ten", () => {
  /** @type {[text: string, shown: string][]} */
  const cases = [
    ["-40 to 85 deg C", "−40 to 85 °C"],
    ["rates from -100 to 100", "rates from −100 to 100"],
    ["[-0.5, 0.5] and (-3)", "[−0.5, 0.5] and (−3)"],
    ["one axis, +-90 deg/s every 15", "one axis, ±90 deg/s every 15"],
    ["1.2 +- 0.3 deg/s", "1.2 ± 0.3 deg/s"],
    ["noise 5e-05 deg/s", "noise 5 × 10⁻⁵ deg/s"],
    ["bias -1.25e-06.", "bias −1.25 × 10⁻⁶."],
    ["2e+06 readings", "2 × 10⁶ readings"],
    ["k_squared -0.0003 (rad/(rad/s))^2", "k_squared −0.0003 (rad/(rad/s))²"],
    ["0.0012 (deg/s)^-1 K^-1", "0.0012 (deg/s)⁻¹ K⁻¹"],
    ["the Bayes factor is e^254", "the Bayes factor is e²⁵⁴"],
    ["body axis -y pointing up", "body axis −y pointing up"],
    ["body axes x and -z pointing up equally", "body axes x and −z pointing up equally"],
  ];
  for (const [text, shown] of cases) assert.equal(typeset(text).replaceAll("\u00a0", " "), shown);
});

test("names, dates, ranges, files and hashes stay as they are", () => {
  for (const text of [
    "FOG-0001",
    "ojeda2000-121",
    "2026-11-29 03:15",
    "data sets 3-12",
    "closed-loop",
    "-zeta and x-y",
    "7c9e-4a5b-129e-4111",
    "log_1e-3.csv",
    "run-2e-05.csv",
    "--add",
    "page",
  ])
    assert.equal(typeset(text), text);
});

test("no line ends within a number with its sign, its power or its percent sign", () => {
  assert.equal(typeset("a probability of > 99 % is stated"), "a probability of >\u00a099\u00a0% is stated");
  assert.equal(typeset("(95 %: 1 to 2)"), "(95\u00a0%: 1 to 2)");
  assert.equal(typeset("1.2 ± 0.3 deg/s"), "1.2\u00a0± 0.3 deg/s");
  assert.equal(typeset("-2.96e-05 deg/s"), "−2.96\u00a0×\u00a010⁻⁵ deg/s");
  assert.equal(typeset("10 values < limit"), "10 values < limit");
});

test("a power is raised, its plus sign left out", () => {
  assert.equal(superscript("-12"), "⁻¹²");
  assert.equal(superscript("+3"), "³");
  assert.equal(superscript(6), "⁶");
});

test("names that people have given stay as they are, wherever they stand in a text", () => {
  assert.equal(typeset("A -7: bias -7 deg/s"), "A −7: bias −7 deg/s");
  withNames([{ serial: "A -7", recipe: { name: "soak +-40" }, files: [{ name: "run -3 1e-3.csv" }], note: "at -5" }]);
  assert.equal(typeset("A -7: bias -7 deg/s"), "A -7: bias −7 deg/s");
  assert.equal(typeset("soak +-40 goes to +-40 deg C"), "soak +-40 goes to ±40 °C");
  assert.equal(typeset("run -3 1e-3.csv (-3 deg C)"), "run -3 1e-3.csv (−3 °C)");
  assert.equal(typeset("at -5"), "at −5"); // no name
});
