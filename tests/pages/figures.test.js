// What figures save and the colours of their values.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  colourAt,
  RATE_SCALE,
  rateColours,
  TEMPERATURE_SCALE,
  temperatureColours,
} from "../../labctl/web/static/js/core/colour_scales.js";
import { csvText, fileName, traceRows } from "../../labctl/web/static/js/core/csv.js";
import { buildFor } from "../../labctl/web/static/js/core/plotly.js";
import { POSITIONS, signature, VARIABLES } from "../../labctl/web/static/js/effects/signatures.js";

test("the small build of Plotly draws flat figures, the whole one everything else", () => {
  const traces = (/** @type {string[]} */ ...types) => types.map((type) => ({ type }));
  assert.equal(buildFor([]), "plotly-cartesian.js");
  assert.equal(buildFor(traces("scatter", "heatmap", "bar")), "plotly-cartesian.js");
  for (const other of ["surface", "scatter3d", "scattergl", "a later type"])
    assert.equal(buildFor(traces("scatter", other)), "plotly.js", other);
});

test("cells with commas, quotes and line ends are quoted", () => {
  const rows = [
    ["a", "b"],
    ['say "x", y', 1],
    [null, undefined],
  ];
  assert.equal(csvText(rows), 'a,b\n"say ""x"", y",1\n,\n');
  assert.equal(csvText([["temperature, °C"], ["\u22125"]]), '"temperature, deg C"\n-5\n'); // signs of programs
});

test("the name of a figure is one of a file", () => {
  assert.equal(fileName("Recording 3: Error over rate!"), "recording-3-error-over-rate");
});

test("lines, dots in space and maps are rows of x, y and z", () => {
  const head = ["trace", "x", "y", "z"];
  assert.deepEqual(traceRows([{ type: "scatter", name: "a", x: [1, 2], y: Float64Array.of(3, 4) }]), [
    head,
    ["a", 1, 3, ""],
    ["a", 2, 4, ""],
  ]);
  assert.deepEqual(traceRows([{ type: "scatter3d", x: [1], y: [2], z: [3] }]), [head, ["", 1, 2, 3]]);
  const map = { type: "heatmap", x: ["p", "q"], y: ["r"], z: [Float64Array.of(5, 6)] };
  assert.deepEqual(traceRows([map]), [head, ["", "p", "r", 5], ["", "q", "r", 6]]);
});

test("rows stand under the titles of the axes, and helper traces are none of them", () => {
  const layout = { xaxis: { title: { text: "rate, deg/s" } }, yaxis: { title: { text: "error<br>deg/s" } } };
  const traces = [
    { type: "scatter", name: "a", x: [1], y: [2] },
    { type: "scatter", name: "cells", x: [1], y: [2], hoverinfo: "skip" },
  ];
  assert.deepEqual(traceRows(traces, layout), [
    ["trace", "rate, deg/s", "error deg/s", "z"],
    ["a", 1, 2, ""],
  ]);
  const different = { ...layout, xaxis2: { title: { text: "time, s" } } };
  assert.deepEqual(traceRows([], different), [["trace", "x", "error deg/s", "z"]]);
});

test("a scale gives its own colours at its stops, and is clipped at its ends", () => {
  assert.equal(colourAt(TEMPERATURE_SCALE, 0), "rgb(47,96,190)");
  assert.equal(colourAt(TEMPERATURE_SCALE, 1), "rgb(189,16,24)");
  assert.equal(colourAt(TEMPERATURE_SCALE, 7), "rgb(189,16,24)");
  assert.equal(colourAt(RATE_SCALE, 0.5), "rgb(143,151,159)");
});

test("rates are coloured about zero, and one temperature alone has the middle colour", () => {
  const rates = rateColours([-50, 100]);
  assert.deepEqual([rates.axis.cmin, rates.axis.cmax], [-100, 100]);
  assert.equal(rates.of(0), colourAt(RATE_SCALE, 0.5));
  assert.equal(temperatureColours([20, 20]).of(20), colourAt(TEMPERATURE_SCALE, 0.5));
});

test("every signature is finite where it is drawn", () => {
  for (const id of ["bias_temperature", "saturation", "run_shift", "g_sensitivity", "thermal_lag"]) {
    const found = signature(id);
    assert.ok(found, id);
    assert.ok(VARIABLES[found.over], id);
    for (const { x, y } of found.lines) assert.ok([...x, ...y].every(Number.isFinite), id);
  }
  assert.equal(signature("g_sensitivity")?.lines[0].y.length, POSITIONS.length);
  assert.equal(signature("unheard_of"), null);
});
