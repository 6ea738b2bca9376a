// Recordings by motion, several recordings together, the trend: rows, marks and addresses.

import assert from "node:assert/strict";
import { test } from "node:test";

import { recordingMarks, symbolOf } from "../../labctl/web/static/js/core/recording_marks.js";
import { faded } from "../../labctl/web/static/js/core/colour_scales.js";
import { asked, inAddress, numbersIn, recordingsText } from "../../labctl/web/static/js/explore/chosen_recordings.js";
import { inDatasetOrder, setText } from "../../labctl/web/static/js/explore/dataset_rows.js";
import { firstModels, heldOutName } from "../../labctl/web/static/js/explore/first_models.js";
import { hasMap } from "../../labctl/web/static/js/explore/residual_cells.js";
import { lessThan, ofAxis, shownOf, times } from "../../labctl/web/static/js/motions/rows.js";

test("one recording or several are asked for, kept in the address, and said", () => {
  const one = { recording: 7, recordings: [7] };
  const several = { recording: 9, recordings: [7, 8, 9] };
  assert.deepEqual(asked(one), { recording: 7 });
  assert.deepEqual(asked(several), { recordings: [7, 8, 9] });
  assert.deepEqual(inAddress(several), { recordings: "7,8,9", recording: null });
  assert.deepEqual(inAddress(one), { recording: "7", recordings: null });
  assert.equal(recordingsText(several), "recordings 7, 8 and 9");
  assert.equal(recordingsText(one), "recording 7");
  assert.deepEqual(numbersIn("9,7,x,7,12", [7, 8, 9]), [7, 9]);
  assert.deepEqual(numbersIn(undefined, [7]), []);
});

test("each recording has a mark of its own", () => {
  const many = Array.from({ length: 16 }, (_, k) => k + 1);
  assert.equal(new Set(many.map((each) => symbolOf(many, each))).size, 16);
  const { marker, legend } = recordingMarks([7, 7, 9], "#000000");
  assert.deepEqual(marker.symbol, ["circle", "circle", "square"]);
  assert.deepEqual(
    legend.map(({ name }) => name),
    ["recording 7", "recording 9"],
  );
  assert.deepEqual(recordingMarks([7, 7], "#000000"), { marker: {}, legend: [] });
  assert.deepEqual(recordingMarks(null, "#000000"), { marker: {}, legend: [] });
});

/** @param {object} sets */
const viewed = (sets) => ({
  axis: "z",
  criticism: { views: { sets: { of: 3, channels: {}, position: [], ...sets } } },
});

test("a preview lays its residuals on the data sets of the right recording", () => {
  const state = viewed({
    dataset: [1, 2, 3],
    recording: [7, 7, 9],
    own_dataset: [1, 2, 1],
    residual_dps: { z: [0, 0, 0] },
    over_floor: { z: [0, 0, 0] },
  });
  const columns = { dataset: [1, 1, 2], recording: [9, 7, 7], axis: ["z", "z", "z"], residual_dps: [0.9, 0.1, 0.2] };
  assert.deepEqual(inDatasetOrder(state, columns, "residual_dps"), [0.1, 0.2, 0.9]);
});

test("pieces of one long data set keep their order, and a thinned one has none", () => {
  const sets = { dataset: [1, 1, 1], residual_dps: { z: [0, 0, 0] }, over_floor: { z: [0, 0, 0] } };
  const columns = { dataset: [1, 1, 1, 1], axis: ["x", "z", "z", "z"], residual_dps: [9, 0.1, 0.2, 0.3] };
  assert.deepEqual(inDatasetOrder(viewed(sets), columns, "residual_dps"), [0.1, 0.2, 0.3]);
  assert.deepEqual(inDatasetOrder(viewed({ ...sets, of: 5 }), columns, "residual_dps"), [null, null, null]);
  const rows = { recording: null, own: [1, 1, 1], dataset: [1, 2, 3], pieces: true };
  assert.equal(setText(rows, 1), "data set 1, piece 2");
  assert.equal(
    setText({ recording: [7, 8], own: [3, 4], dataset: [1, 2], pieces: false }, 1),
    "recording 8, data set 4",
  );
});

test("a map is drawn only where rates and temperatures repeat", () => {
  /** @param {number[]} rates */
  const of = (rates) => ({ maps: [{ axis: "z", rate_level_dps: rates }] });
  /**
   * @param {number[]} rates
   * @param {"rates" | "rest" | "profile"} motion
   */
  const state = (rates, motion) => /** @type {any} */ ({ criticism: of(rates), axis: "z", motion });
  assert.equal(hasMap(state([0, 10], "rates")), true);
  assert.equal(hasMap(state([0, 0], "rest")), false);
  assert.equal(hasMap(state([1, 2, 3], "profile")), false);
});

test("rows of an axis, differences and factors keep what is unknown", () => {
  const columns = { axis: ["x", "z", "x"], value: [1, 2, 3] };
  assert.deepEqual(ofAxis(columns, "x"), { axis: ["x", "x"], value: [1, 3] });
  assert.deepEqual(lessThan([3, null, 1], [1, 1, null]), [2, null, null]);
  assert.deepEqual(times([2, null], 0.5), [1, null]);
  assert.equal(shownOf({ rows: 5, of: 5 }, "rows"), "");
  assert.match(shownOf({ rows: 4000, of: 5950 }, "windows"), /4,000 of 5,950 windows/);
});

test("the first models and the held-out error are those of the motion", () => {
  assert.deepEqual(
    firstModels("rest").map(({ id }) => id),
    ["bias_temperature", "bias"],
  );
  assert.deepEqual(firstModels("profile")[0].body.effects?.slice(2), ["time_delay", "bandwidth"]);
  assert.equal(firstModels(undefined)[0].id, "bias_scale");
  assert.equal(heldOutName("poses"), "at turns left out");
  assert.equal(heldOutName("rest"), "at temperatures left out");
});

test("a band is faded in a form that the drawing library knows", () => {
  assert.equal(faded("#1f5fa8", 0.16), "rgba(31,95,168,0.16)");
});
