// Colours that mean something are told apart by people with any of the usual colour vision deficiencies.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import {
  differenceCiede2000,
  filterDeficiencyDeuter,
  filterDeficiencyProt,
  filterDeficiencyTrit,
  parse,
  wcagContrast,
} from "culori";

import { DIVERGING, RATE_SCALE, TEMPERATURE_SCALE } from "../../labctl/web/static/js/core/colour_scales.js";

/** Machado, Oliveira and Fernandes 2009, full severity, as culori computes them. */
const VISIONS = {
  usual: (/** @type {import("culori").Color} */ colour) => colour,
  protanopia: filterDeficiencyProt(1),
  deuteranopia: filterDeficiencyDeuter(1),
  tritanopia: filterDeficiencyTrit(1),
};
/** CIEDE2000: a difference below about 2 is not seen, one of 10 at a glance; a mark of a few pixels needs more. */
const MIN_DIFFERENCE = 12;
const difference = differenceCiede2000();
const [light, dark] = readFileSync("labctl/web/static/css/tokens.css", "utf8").split('[data-theme="dark"]');

/**
 * @param {string} theme
 * @param {string} name
 */
function token(theme, name) {
  const value = new RegExp(`--${name}: (#[0-9a-f]{6});`).exec(theme)?.[1];
  assert.ok(value, name);
  return value;
}

/** @param {string} text */
function colour(text) {
  const parsed = parse(text);
  assert.ok(parsed, text);
  return parsed;
}

/**
 * The least difference of any two of the colours, with the vision and the pair.
 * @param {readonly string[]} colours
 */
function leastDifference(colours) {
  return Object.entries(VISIONS)
    .flatMap(([vision, seen]) =>
      colours.flatMap((one, k) =>
        colours.slice(k + 1).map((other) => ({
          least: difference(seen(colour(one)), seen(colour(other))),
          of: `${one} and ${other}, ${vision}`,
        })),
      ),
    )
    .reduce((a, b) => (b.least < a.least ? b : a));
}

const AXES = ["axis-x", "axis-y", "axis-z"];
const STATES = ["good", "warn", "bad"];
const scale = (/** @type {readonly (readonly [number, string])[]} */ stops) => stops.map(([, each]) => each);
/** @type {[string, readonly string[]][]} */
const FAMILIES = [
  ["axes, light", AXES.map((name) => token(light, name))],
  ["axes, dark", AXES.map((name) => token(dark, name))],
  ["states, light", STATES.map((name) => token(light, name))],
  ["states, dark", STATES.map((name) => token(dark, name))],
  ["temperatures", scale(TEMPERATURE_SCALE)],
  ["rates", scale(RATE_SCALE)],
  ["residual over floor", scale(DIVERGING)],
];

for (const [name, colours] of FAMILIES)
  test(`${name}: any two colours differ in every colour vision`, () => {
    const { least, of } = leastDifference(colours);
    assert.ok(least >= MIN_DIFFERENCE, `${of}: ${least.toFixed(1)} < ${MIN_DIFFERENCE}`);
  });

test("words in the colour of a state have the contrast of WCAG 2.2 AA on what they stand on", () => {
  for (const theme of [light, dark])
    for (const name of STATES)
      for (const ground of ["surface", "background", `${name}-subtle`])
        assert.ok(wcagContrast(token(theme, name), token(theme, ground)) >= 4.5, `${name} on ${ground}`);
});
