// Numbers, sizes, durations and results as text.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { test } from "node:test";

import * as format from "../../labctl/web/static/js/core/format.js";
import { roundedToUncertainty } from "../../labctl/web/static/js/core/rounding.js";
import { shownUnit, unitText } from "../../labctl/web/static/js/core/shown_unit.js";
import { timeUnit } from "../../labctl/web/static/js/core/time_unit.js";
import { typeset } from "../../labctl/web/static/js/core/typeset.js";

/** @type {(act: (...given: any[]) => unknown, cases: [given: unknown[], text: string][]) => void} */
const holds = (act, cases) => {
  for (const [given, text] of cases) assert.equal(act(...given), text, `${act.name}(${given.join(", ")})`);
};

test("a number has its significant digits, and a power of ten only far from 1", () => {
  holds(format.number, [
    [[0.0012], "0.00120"],
    [[1234.5], "1230"],
    [[-1234.5], "−1230"],
    [[-0.0042, 2], "−0.0042"],
    [[-4.5e-7, 2], "−4.5 × 10⁻⁷"],
    [[9.999], "10.0"],
    [[0], "0"],
    [[4.5e-7, 2], "4.5 × 10⁻⁷"],
    [[12_345_678], "1.23 × 10⁷"],
    [[null], "–"],
    [[undefined], "–"],
    [[NaN], "–"],
    [[Infinity], "–"],
  ]);
});

test("a setting has no trailing zeros", () => {
  holds(format.plainNumber, [
    [[-100], "−100"],
    [[-1270.4], "−1270"],
    [[12.5], "12.5"],
    [[-2.5e-7], "−2.5e−7"],
    [[0.0042], "0.0042"],
    [[null], "–"],
  ]);
});

test("means line up at one place beyond their spread", () => {
  holds(format.mean, [
    [[1.23456, 0.01], "1.2346"],
    [[1.2, 0.01], "1.2000"],
    [[123.4567, null], "123.46"],
    [[123.4567, 0], "123.46"],
  ]);
});

test("a duration is in the two units that matter", () => {
  holds(format.duration, [
    [[4780.6], "1 h 20 min"],
    [[3599], "1 h 0 min"],
    [[3569], "59 min 29 s"],
    [[162_600], "45 h 10 min"],
    [[200], "3 min 20 s"],
    [[12.4], "12 s"],
    [[-3], "0 s"],
    [[null], "–"],
  ]);
});

test("a size without a unit is a share", () => {
  holds(format.sizeText, [
    [[0.000014, "1", "scale_factor"], "14 ppm"],
    [[0.027, "1", "scale_factor"], "27000 ppm"],
    [[0.027, "1", "dead_band"], "2.7 %"],
    [[0.5, "(deg/s)^-1", "scale_factor_r2"], "0.50 (deg/s)⁻¹"],
    [[0, "deg/s", "bias"], "0 deg/s"],
    [[NaN, "1", "scale_factor"], "–"],
  ]);
});

/** @type {[unit: string, name: string, factor: number, shown: string][]} */
const units = JSON.parse(readFileSync("tests/pages/shown_units.json", "utf8"));

test("a quantity is shown in one unit, whatever its size", () => {
  for (const [unit, name, factor, shown] of units)
    assert.deepEqual(shownUnit(unit, name), [factor, unitText(shown)], name);
  const rows = [
    { name: "scale_factor", value: 0.02 },
    { name: "scale_factor", value: 0.0003 },
    { name: "misalignment_y", value: 0.02 },
  ];
  const texts = rows.map(({ value, name }) => format.withUncertainty(value, 2e-5, "1", name));
  assert.deepEqual(texts, ["20000 ± 20 ppm", "300 ± 20 ppm", "20.000 ± 0.020 mrad"]);
});

test("a result and its uncertainty end at the same place", () => {
  holds(format.withUncertainty, [
    [[0.0002013, 0.0000031, "1"], "201.3 ± 3.1 ppm"],
    [[9.06e-7, 2.1e-9, "(deg/s)^-1"], "(9.060 ± 0.021) × 10⁻⁷ (deg/s)⁻¹"],
    [[-0.02, 0.0031, "deg/s"], "−0.0200 ± 0.0031 deg/s"],
    [[-9.06e-7, 2.1e-9, "(deg/s)^-1"], "(−9.060 ± 0.021) × 10⁻⁷ (deg/s)⁻¹"],
    [[1.5, null, "deg/s"], "1.5 deg/s"],
    [[-1.5, null, "deg/s"], "−1.5 deg/s"],
    [[null, 1, "deg/s"], "–"],
  ]);
});

test("the uncertainty has two significant digits, and the value its place", () => {
  assert.deepEqual(roundedToUncertainty(1.23456, 0.0999), { value: "1.23", u: "0.10", exponent: 0 });
  assert.deepEqual(roundedToUncertainty(1234.5, 120), { value: "1230", u: "120", exponent: 0 });
  assert.equal(roundedToUncertainty(-0.00002, 0.0019).value, "0.0000"); // a zero has no sign
  assert.deepEqual(roundedToUncertainty(0, null), { value: "0", u: null, exponent: 0 });
});

test("every way to write a negative number has the minus sign", () => {
  const written = [
    format.number(-12.3),
    format.plainNumber(-12.3),
    format.withUnit(-12.3, "deg/s"),
    format.count(-1234),
    format.percent(-0.5),
    format.fixed(-12.3, 1),
    format.mean(-12.3, 0.1),
    format.sizeText(-12.3, "deg/s", "bias"),
    format.sizeText(-0.000014, "1", "scale_factor"),
    format.withUncertainty(-12.3, 0.1, "deg/s"),
  ];
  for (const text of written) assert.match(text, /^−\d[^-]*$/);
});

/** @type {[probability: number, text: string][]} */
const probabilities = JSON.parse(readFileSync("tests/pages/probabilities.json", "utf8"));

/** @type {[share: number, text: string][]} */
const shares = JSON.parse(readFileSync("tests/pages/shares.json", "utf8"));

test("what was computed is neither impossible nor certain", () => {
  for (const [probability, text] of probabilities) assert.equal(format.probabilityText(probability), text);
});

test("only nothing is 0 %, and only all is 100 %", () => {
  for (const [share, text] of shares) assert.equal(format.percent(share), text);
  assert.equal(format.percent(null), "–");
});

test("ids and units are words", () => {
  assert.equal(format.idText("scale_factor_asymmetry"), "scale factor asymmetry");
  assert.equal(unitText("deg/s^2"), "deg/s²");
  assert.equal(unitText("1"), "");
});

test("a time axis is in hours, minutes or seconds", () => {
  assert.equal(timeUnit(7200, 7200).name, "h");
  assert.equal(timeUnit(7199, 7200).name, "min");
  assert.deepEqual(timeUnit(599, 7200), { name: "s", seconds: 1 });
});

/** @type {[nats: number, text: string][]} */
const odds = JSON.parse(readFileSync("tests/pages/odds.json", "utf8"));

test("evidence is said as odds", () => {
  for (const [nats, text] of odds) assert.equal(format.oddsText(nats), typeset(text));
  holds(format.oddsText, [
    [[0], "1 to 1"],
    [[Math.log(20)], "20 to 1"],
    [[-Math.log(20)], "1 to 20"],
    [[7.16], "1300 to 1"],
    [[200], "10⁸⁷ to 1"],
    [[22600], "more than 10¹⁰⁰ to 1"],
  ]);
});

test("effects in a sentence of the service are written as their links are", () => {
  const ids = ["scale_factor_odd", "scale_factor", "bias"];
  assert.equal(
    format.inWords("adding scale_factor_odd, not bias_temperature: `labctl improve A --add scale_factor_odd`", ids),
    "adding scale factor odd, not bias_temperature: `labctl improve A --add scale_factor_odd`",
  );
  assert.equal(format.inWords("scale_factor.", ids), "scale factor.");
  assert.equal(format.inWords("Missing: scale_factor (Scale factor).", ids), "Missing: scale factor.");
  assert.equal(format.inWords("scale_factor_odd (Cubic error) or more", ids), "scale factor odd (Cubic error) or more");
  assert.equal(
    format.inWords("scale_factor_odd (Scale factor odd (cubic)); or scale_factor_odd (Cubic (odd) error)", ids),
    "scale factor odd (cubic); or scale factor odd (Cubic (odd) error)",
  );
  const simple = format.inWords("Missing: saturation (Saturation (input rate limit)).", ["saturation"]);
  assert.equal(simple, "Missing: saturation (input rate limit).");
  assert.equal(format.inWords("nothing", []), "nothing");
});

test("an instant of another year has its year", () => {
  const now = new Date();
  assert.doesNotMatch(format.instant(now.toISOString()), new RegExp(String(now.getFullYear())));
  assert.match(format.instant("2019-06-05T08:00:00Z"), /5 Jun 2019/);
  assert.match(format.dated(now.toISOString()), new RegExp(`${now.getFullYear()}, \\d\\d:\\d\\d$`));
  assert.equal(format.dated(null), "–");
});

test("a mean that is rounded to zero has no sign", () => {
  holds(format.mean, [
    [[-0.00004, 1], "0.00"],
    [[-0.00004, 0.0001], "−0.000040"],
    [[-0.06, 1], "−0.06"],
  ]);
});

test("only a result with its expanded uncertainty has the sign ±", () => {
  const folder = "labctl/web/static/js";
  const signed = readdirSync(folder, { recursive: true, encoding: "utf8" })
    .filter((name) => name.endsWith(".js") && /[`"'][^`"']*±/.test(readFileSync(`${folder}/${name}`, "utf8")))
    .sort();
  // the text itself; what the service writes as +-; the heading of a column of such texts; where a line may break in one
  assert.deepEqual(signed, [
    "core/format.js",
    "core/typeset.js",
    "explore/suspect_notes.js",
    "explore/verdict_card.js",
    "fleet/report_card.js",
    "unit/sensors.js",
  ]);
  assert.equal(format.scatterText(0.01234), "s = 0.012");
});
