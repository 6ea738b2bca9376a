// Explore: selections, labels, cells of the residual map, rows of the comparison.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  alongRate,
  ownRows,
  pickRows,
  rms,
  rowsWhere,
  turns,
} from "../../labctl/web/static/js/explore/compare/rows.js";
import {
  distinctLabels,
  fromRanges,
  inDatasetOrder,
  scaled,
  toRanges,
} from "../../labctl/web/static/js/explore/dataset_rows.js";
import { residualText, usualRecording, usualVersion } from "../../labctl/web/static/js/explore/chosen_recordings.js";
import { sharedReasons } from "../../labctl/web/static/js/explore/experiment_reasons.js";
import { cellText, cellsText, mapCells } from "../../labctl/web/static/js/explore/residual_cells.js";

test("a selection is written as ranges and read again", () => {
  const numbers = [3, 1, 2, 20, 7, 8];
  assert.equal(toRanges(numbers), "1-3,7-8,20");
  assert.deepEqual([...fromRanges("1-3,7-8,20")], [1, 2, 3, 7, 8, 20]);
  assert.deepEqual([...fromRanges(undefined)], []);
  assert.deepEqual([...fromRanges("x,5,1-9999999")], [5]);
});

test("labels have as many digits as tell them apart", () => {
  assert.deepEqual(distinctLabels([1, 2.5]), ["1", "2.5"]);
  assert.deepEqual(distinctLabels([100.01, 100.02]), ["100.01", "100.02"]);
  assert.deepEqual(distinctLabels([-20, 0.00964, 25]), ["−20", "0", "25"]);
  assert.deepEqual(distinctLabels([-0.001, 0.001, 25]), ["−0.001", "0.001", "25"]); // two near 0 stay apart
});

test("times are in hours", () => {
  assert.deepEqual(scaled("t_s", [3600, 7200]), [1, 2]);
  assert.deepEqual(scaled("temperature_c", [20]), [20]);
});

const map = {
  dataset: [1, 2, 3],
  temperature_c: [20.1, 19.9, 40.2],
  rate_level_dps: [10, 10, -10],
  temperature_level_c: [20, 20, 40],
  over_floor: [2, 4, -12],
};

test("data sets of the same rate and temperature share a cell", () => {
  const { rates, temperatures, cells } = mapCells(map);
  assert.deepEqual(
    [rates, temperatures],
    [
      [-10, 10],
      [20, 40],
    ],
  );
  assert.deepEqual(
    cells.map(({ rate, sets, mean }) => [rate, sets, mean]),
    [
      [10, [1, 2], 3],
      [-10, [3], -12],
    ],
  );
});

test("a cell of one data set has its own temperature, of several that of the row", () => {
  const [two, one] = mapCells(map).cells.map((cell) => cellText(cell, "z").split("<br>"));
  assert.deepEqual(two, ["10 deg/s, row 20 °C, z up", "3.0 times the noise floor", "data set 1, 2"]);
  assert.equal(one[0], "−10 deg/s, 40.2 °C, z up");
});

test("how wide a row of temperatures is, is said where it is not nothing", () => {
  /** @param {number} level_width_c */
  const text = (level_width_c) => cellsText(/** @type {any} */ ({ maps: [{ level_width_c }] }));
  assert.match(text(1.5), /within 1\.5 K\.$/);
  assert.match(text(0), /0\.25 K\.$/);
});

test("residuals are brought into the order of the criticism's data sets", () => {
  const views = /** @type {any} */ ({ sets: { dataset: [2, 1, 3], residual_dps: {}, over_floor: {} } });
  const columns = { dataset: [1, 2, 1], axis: ["z", "z", "x"], residual_dps: [0.1, 0.2, 0.9] };
  assert.deepEqual(inDatasetOrder({ criticism: { views }, axis: "z" }, columns, "residual_dps"), [0.2, 0.1, null]);
});

const columns = /** @type {any} */ ({
  dataset: [1, 2, 3],
  axis: ["z", "z", "x"],
  position: ["-z", "x", "x"],
  table_rate_dps: [5, 6, 7],
});

test("an axis turns in its own position, the other way round where it points down", () => {
  assert.ok(turns("-z", "z"));
  assert.ok(!turns("x", "z"));
  const own = ownRows({ columns }, "z");
  assert.deepEqual([own.dataset, own.rate], [[1], [-5]]);
  assert.deepEqual(alongRate({ at: [1, 2], position: "-z" }, "y"), [[-1, -2], "y"]);
});

test("an axis that never turns has all of its rows", () => {
  const still = { columns: { ...columns, position: ["x", "x", "x"] } };
  assert.deepEqual(ownRows(still, "z").dataset, [1, 2]);
  assert.deepEqual(rowsWhere(still, (k) => k === 2).rate, [7]);
});

test("rows of columns are picked together", () => {
  assert.deepEqual(pickRows({ a: [1, 2, 3], b: ["x", "y", "z"] }, [2, 0]), { a: [3, 1], b: ["z", "x"] });
  assert.equal(rms([3, 4, 0, 0]), 2.5);
  assert.equal(rms([]), 0);
});

test("the recording of a campaign that has not ended is not compared while there is another one", () => {
  const row = (/** @type {number} */ id, /** @type {number} */ datasets, unfinished = false) => ({
    id,
    datasets,
    unfinished,
    experiment: false,
  });
  assert.equal(usualRecording([row(7, 84), row(45, 42, true)]), 7);
  assert.equal(usualRecording([row(7, 84), row(45, 42)]), 45);
  assert.equal(usualRecording([row(4, 121), row(5, 23)]), 4);
  assert.equal(usualRecording([row(45, 3, true)]), 45);
});

test("an experiment of a diagnosis is no recording to begin with, while there is another", () => {
  const rows = [
    { id: 22, datasets: 84, unfinished: false, experiment: false },
    { id: 26, datasets: 69, unfinished: false, experiment: true },
  ];
  assert.equal(usualRecording(rows), 22);
  assert.equal(usualRecording(rows.slice(1)), 26);
});

test("what the reasons of experiments have in common is said once", () => {
  const { common, own } = sharedReasons([
    "1.2 h are expected to give 0.04 bit; 35 experiments are ordered by hour; a verdict requires evidence.",
    "1.7 h are expected to give 0.05 bit; 35 experiments are ordered by hour; a verdict requires evidence.",
  ]);
  assert.equal(common, "35 experiments are ordered by hour; a verdict requires evidence.");
  assert.deepEqual(own, ["1.2 h are expected to give 0.04 bit.", "1.7 h are expected to give 0.05 bit."]);
  assert.deepEqual(sharedReasons(["one; two."]), { common: "", own: ["one; two."] });
  assert.deepEqual(sharedReasons(["a; b", "c; d"]), { common: "", own: ["a; b.", "c; d."] });
});

test("without a version in the address, the one in force is shown; else the newest", () => {
  assert.equal(usualVersion({ calibrations: [1, 2, 3], certified_version: 2 }), 2);
  assert.equal(usualVersion({ calibrations: [3, 1, 2], certified_version: null }), 3);
  assert.equal(usualVersion({ calibrations: [], certified_version: null }), undefined);
});

test("the residual is of the fit itself, or of a fit to other recordings, and the sentence says which", () => {
  /** @type {(recordings: number[], of: number[]) => string} */
  const words = (recordings, of) =>
    residualText({ version: 3, recording: recordings.at(-1) ?? 0, recordings, calibration: { recordings: of } });
  assert.match(words([7], [7]), /model of version 3 leaves of recording 7, to which it was fitted/);
  assert.match(words([8, 10], [10, 8]), /leaves of recordings 8 and 10, to which it was fitted/); // in any order
  for (const [chosen, of] of [
    [[8], [7]],
    [[8, 10], [8]],
    [[8], [8, 10]],
  ]) {
    assert.match(words(chosen, of), /^The model of version 3 was refitted to recordings? 8/);
    assert.doesNotMatch(words(chosen, of), /to which it was fitted/);
  }
});
