import assert from "node:assert/strict";
import test from "node:test";

import { allSeries, appendLive, inRange, panels } from "../../labctl/web/static/js/campaigns/channel_series.js";

const STEPS = /** @type {any} */ ({
  number: [1, 2, 3, 4],
  kind: ["soak", "acquire", "acquire", "acquire"],
  started_s: [0, 100, 130, null],
  ended_s: [90, 120, 150, null],
  temperature_c: [20, 20, 20, 20],
  rate_dps: [null, -40, 40, 10],
  dataset: [null, 7, 3, 9],
});
const COURSE = {
  campaign: 1,
  samples: 3,
  t_s: [0, 60, 160],
  chamber_c: [25, 21, 20],
  setpoint_c: [20, 20, null],
  units_c: { A: [25, 23, null] },
};
const SETS = /** @type {any} */ ({
  recording: 1,
  number: [3, 7, 9],
  state: ["complete", "complete", "planned"],
  channels: { gyro_z: { mean: [40.5, -40.5, null] }, temperature_c: { mean: [22, 21, null] } },
  output: { z: { unit: "V" } },
});
const series = () => allSeries(COURSE, STEPS, [{ serial: "A", sets: SETS }]);
/** @param {string} id */
const one = (id) => /** @type {any} */ (series().find((each) => each.id === id));

test("the series are environment, rate of the steps, and means in the order in which they were measured", () => {
  assert.deepEqual(
    series().map(({ id, unit }) => [id, unit]),
    [
      ["setpoint", "°C"],
      ["chamber", "°C"],
      ["unit.A", "°C"],
      ["rate", "deg/s"],
      ["mean.A.gyro_z", "V"],
      ["mean.A.temperature_c", "°C"],
    ],
  );
  assert.deepEqual(
    [one("rate").t_s, one("rate").values],
    [
      [0, 100, 130],
      [0, -40, 40],
    ],
  );
  assert.deepEqual(
    [one("mean.A.gyro_z").t_s, one("mean.A.gyro_z").values],
    [
      [110, 140],
      [-40.5, 40.5],
    ],
  );
});

test("a range keeps what lies in it, and a held value begins with what held before", () => {
  assert.deepEqual(inRange(one("chamber"), 50, 100).t_s, [60]);
  const rate = inRange(one("rate"), 110, 140);
  assert.deepEqual(
    [rate.t_s, rate.values],
    [
      [110, 130, 140],
      [-40, 40, 40],
    ],
  );
  assert.deepEqual(inRange(one("mean.A.gyro_z"), 120, 200).values, [40.5]);
});

test("panels are one for each unit", () => {
  assert.deepEqual(
    panels(series()).map(([unit, members]) => [unit, members.length]),
    [
      ["°C", 4],
      ["deg/s", 1],
      ["V", 1],
    ],
  );
});

test("progress messages add outputs and references once each time", () => {
  const live = new Map();
  /** @param {number} t_s */
  const status = (t_s) =>
    /** @type {any} */ ({
      t_s,
      references: { reference_c: 21 + t_s },
      outputs: [{ gyro: "g1", channel: "gyro_z", unit: "deg/s", t_s, mean: 2 * t_s, std: 0, n: 3 }],
    });
  for (const t_s of [1, 1, 2]) appendLive(live, status(t_s));
  assert.deepEqual([...live.keys()], ["now.g1.gyro_z", "now.reference_c"]);
  assert.deepEqual(
    [live.get("now.g1.gyro_z").t_s, live.get("now.g1.gyro_z").values],
    [
      [1, 2],
      [2, 4],
    ],
  );
  assert.deepEqual(live.get("now.reference_c").values, [22, 23]);
});
