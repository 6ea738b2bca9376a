// Recordings: channels, traces with gaps, the files of a recording, and coefficients over temperature.

import assert from "node:assert/strict";
import { test } from "node:test";

import { count } from "../../labctl/web/static/js/core/format.js";
import { channelName, channelTitle, channelUnit } from "../../labctl/web/static/js/recordings/channels.js";
import { recordingFiles } from "../../labctl/web/static/js/recordings/file_input.js";
import { leaveOutChoices, leftOutText } from "../../labctl/web/static/js/recordings/leave_out.js";
import { continuousPieces, envelopeOutline, meanLine } from "../../labctl/web/static/js/recordings/trace_pieces.js";
import { coefficientColumns, isSingle } from "../../labctl/web/static/js/unit/coefficient_table.js";

test("a channel has the name and the unit of its column", () => {
  assert.equal(channelName("table_rate_dps"), "table rate");
  assert.equal(channelName("board_temp_c"), "board temp");
  assert.equal(channelName("gyro_z"), "gyro output z");
  assert.equal(channelUnit("board_temp_c"), "°C");
  assert.equal(channelUnit("gyro_z"), "deg/s");
  assert.equal(channelUnit("gyro_z", { z: { unit: "V" } }), "V");
  assert.equal(channelUnit("valid"), "");
  assert.equal(channelTitle("supply_v", "V"), "supply, V");
});

test("a trace is in pieces where more than three columns lack", () => {
  assert.deepEqual(continuousPieces([0, 1, 2, 10, 11], 1), [
    [0, 2],
    [3, 4],
  ]);
  assert.deepEqual(continuousPieces([0, 1, 3, 5], 1), [[0, 3]]);
  assert.deepEqual(continuousPieces([], 1), []);
});

test("lines stop and outlines close at the end of a piece", () => {
  const line = meanLine(
    [0, 1],
    [5, 6],
    ["a", "b"],
    [
      [0, 0],
      [1, 1],
    ],
  );
  assert.deepEqual(line, { x: [0, null, 1, null], y: [5, null, 6, null], text: ["a", null, "b", null] });
  assert.deepEqual(envelopeOutline([0, 1], { min: [1, 2], max: [3, 4] }, [[0, 1]]), {
    x: [0, 1, 1, 0, 0, null],
    y: [3, 4, 2, 1, 3, null],
  });
});

test("of a folder only the files of a recording are taken", () => {
  const files = ["recording.toml", "samples.parquet", "notes.txt", "samples.csv.bak"].map((name) => ({ name }));
  const { files: own, left } = recordingFiles(files);
  assert.deepEqual(
    own.map((file) => file.name),
    ["recording.toml", "samples.parquet"],
  );
  assert.deepEqual(left, ["notes.txt", "samples.csv.bak"]);
});

test("coefficients over temperature are columns, single ones are none", () => {
  const column = { value: [1, 2], u: [0.1, null], unit: "1" };
  const rest = { identified: [true, false], at_most: [null, null] };
  const own = { temperature_c: [20, 40], scale_factor: { ...column, ...rest } };
  const found = { axis: "z", name: "scale_factor", temperature_c: [20, 40], ...column };
  assert.deepEqual(coefficientColumns({ axes: { z: { coefficients: own } } }), [found]);
  const bias = { value: 1, u: null, unit: "deg/s", identified: true, at_most: null };
  assert.deepEqual(coefficientColumns({ axes: { z: { coefficients: { bias } } } }), []);
  assert.ok(isSingle(bias) && !isSingle(own.scale_factor) && !isSingle(own.temperature_c) && !isSingle(undefined));
});

test("readings that can be left out are one choice for each kind", () => {
  const warnings = [
    { what: "spikes", channel: "gyro_x", n: 2, may_leave_out: true },
    { what: "gaps", channel: "t_s", n: 4, may_leave_out: false },
    { what: "spikes", channel: "gyro_y", n: 1, may_leave_out: true },
    { what: "time_back", channel: "t_s", n: 1200, may_leave_out: true },
  ];
  assert.deepEqual(leaveOutChoices(warnings, 60000), [
    { kind: "spikes", text: `spikes: 2 of gyro_x, 1 of gyro_y (of ${count(60000)} readings)` },
    { kind: "time_back", text: `time_back: ${count(1200)} (of ${count(60000)} readings)` },
  ]);
  assert.deepEqual(leaveOutChoices([], 5), []);
  assert.equal(
    leftOutText({ what: "spikes", n: 2, of: 400, channel: "gyro_x", why: "far off" }),
    "Left out: 2 of 400 readings of gyro_x (far off).",
  );
});
