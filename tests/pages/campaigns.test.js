// Campaigns: their states, the steps of a plan, and the columns of what was heard.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  appendStatus,
  emptyHistory,
  MAX_POINTS,
  remainingSeconds,
} from "../../labctl/web/static/js/bench/campaign_history.js";
import { planSteps, positionBands, setPointCourse } from "../../labctl/web/static/js/campaigns/plan_steps.js";
import { canResume, hasEnded, isRunning, stateKind, stateText } from "../../labctl/web/static/js/campaigns/states.js";
import { visibilityGroups } from "../../labctl/web/static/js/campaigns/visibility.js";
import { withButtonNamed } from "../../labctl/web/static/js/campaigns/draft_text.js";

test("what a campaign permits is what the service says of it", () => {
  assert.ok(isRunning({ active: true }) && !isRunning({ active: false }));
  assert.ok(hasEnded({ ended: true }) && !hasEnded({ ended: false }));
  assert.ok(canResume({ active: false, state: "failed" }) && canResume({ active: false, state: "running" }));
  assert.ok(!canResume({ active: true, state: "paused" }) && !canResume({ active: false, state: "done" }));
});

test("a state has its words and its colour", () => {
  assert.deepEqual([stateText({ state: "waiting" }), stateKind({ state: "waiting" })], ["waits for a person", "warn"]);
  assert.deepEqual([stateText({ state: "done" }), stateKind({ state: "done" })], ["done", "good"]);
  /** @type {{ state: "running", abandoned: boolean }} */
  const abandoned = { state: "running", abandoned: true };
  assert.deepEqual([stateText(abandoned), stateKind(abandoned)], ["running, no process runs it", "warn"]);
});

test("a state that the page does not know is named", () => {
  const campaign = /** @type {any} */ ({ state: "hibernating" });
  assert.deepEqual([stateText(campaign), stateKind(campaign)], ["hibernating", "warn"]);
});

const timeline = {
  number: [1, 2, 3],
  kind: ["move_chamber", "measure", "measure"],
  start_s: [0, 600, 700],
  expected_s: [600, 100, 100],
  temperature_c: [20, 20, 20],
  rate_dps: [null, 10, -10],
  turn_deg: [null, null, null],
  position: ["x", "x", "-x"],
  dataset: [null, 1, 2],
};

test("steps are where they were planned, or where they have been", () => {
  const planned = planSteps(timeline, 60);
  assert.deepEqual([planned[1].from, planned[1].until, planned[1].state], [10, 700 / 60, "to come"]);
  const done = planSteps(
    { ...timeline, state: ["done", "done", "skipped"], forecast_s: [0, 620, 760], ended_s: [620, 760, null] },
    1,
  );
  assert.deepEqual(
    done.map(({ from, until, state }) => [from, until, state]),
    [
      [0, 620, "done"],
      [620, 760, "done"],
      [760, 760, "skipped"],
    ],
  );
});

test("the set point ramps while the chamber moves and holds in between", () => {
  const steps = [
    { kind: "measure", warm: 20, from: 0, until: 1 },
    { kind: "home", warm: null, from: 1, until: 2 },
    { kind: "move_chamber", warm: 50, from: 2, until: 3 },
  ];
  assert.deepEqual(setPointCourse(steps), { x: [0, 1, 2, 3], y: [20, 20, 20, 50] });
});

test("neighbouring steps of a position are one band", () => {
  assert.deepEqual(positionBands(planSteps(timeline, 1)), [
    { position: "x", from: 0, until: 700 },
    { position: "-x", from: 700, until: 800 },
  ]);
});

test("progress is kept in order of time, and only the newest of it", () => {
  const history = emptyHistory();
  const status = { chamber_c: 20, gyro_c: null, rate_dps: 1 };
  for (const t_s of [1, 2, 2, 1.5, null]) appendStatus(history, { ...status, t_s }, 25);
  assert.deepEqual(history.t_s, [1, 2]);
  assert.deepEqual(history.setpoint_c, [25, 25]);
  for (let t_s = 3; t_s <= MAX_POINTS + 5; t_s += 1) appendStatus(history, { ...status, t_s }, 25);
  assert.deepEqual([history.t_s.length, history.t_s[0], history.gyro_c.length], [MAX_POINTS, 6, MAX_POINTS]);
});

test("what remains is the share that has not passed", () => {
  assert.equal(remainingSeconds({ progress: 0.25 }, 400), 300);
});

test("a draft names the button that puts it in force, not the command", () => {
  const text = "It is not certified; `labctl certify FOG-0001 1 --by NAME --reason TEXT` puts it in force.";
  assert.equal(
    withButtonNamed(text),
    "It is not certified; the button “Certify: put in force” on the page of the unit puts it in force.",
  );
});

test("an effect of the model is estimated; one that it absorbs, or that is not excited, cannot be detected", () => {
  const rows = /** @type {any[]} */ ([
    { effect: "bias", visible: false, share: 0, why: "schedule", in_model: true },
    { effect: "scale_factor_even", visible: true, share: 0.2, in_model: true, order: 4 },
    { effect: "dead_band", visible: true, share: 0.9, in_model: false },
    { effect: "time_delay", visible: false, share: 0, why: "schedule", in_model: false },
    { effect: "warm_up", visible: false, share: 0.1, why: "schedule", in_model: false },
    { effect: "quantization", visible: false, share: 0, why: "channel", in_model: false },
  ]);
  const names = Object.entries(visibilityGroups(rows)).map(([group, some]) => [group, some.map((row) => row.effect)]);
  assert.deepEqual(Object.fromEntries(names), {
    seen: ["dead_band", "scale_factor_even"],
    estimated: ["bias"],
    absorbed: ["time_delay"],
    unseen: ["warm_up", "quantization"],
  });
});
