// The rounds of a diagnosis: which suspects have a column, and what stands in the cells.

import assert from "node:assert/strict";
import { test } from "node:test";

import { diagnosisState, lineOfRound, suspectColumns } from "../../labctl/web/static/js/unit/diagnosis_rounds.js";

const ROUND = {
  spent_hours: 2.14,
  verdict: /** @type {const} */ ("ambiguous"),
  named: ["thermal_lag", "warm_up"],
  suspects: { warm_up: 0.61, run_shift: 0.001 },
  why: "2.1 h: the rates in random order",
  came_text: "",
};

test("effects that a verdict names come first, then the most probable", () => {
  assert.deepEqual(suspectColumns([ROUND]), ["thermal_lag", "warm_up", "run_shift"]);
  const many = Object.fromEntries(Array.from({ length: 9 }, (_, place) => [`effect_${place}`, place / 10]));
  assert.equal(suspectColumns([{ named: [], suspects: many }])[0], "effect_8");
  assert.equal(suspectColumns([{ named: [], suspects: many }]).length, 5);
});

test("a suspect that is not listed has no probability, and none is impossible or certain", () => {
  const line = lineOfRound(ROUND, ["thermal_lag", "warm_up", "run_shift"]);
  assert.deepEqual(line.probabilities, ["–", "61 %", "< 1 %"]);
  assert.deepEqual(lineOfRound({ ...ROUND, suspects: { warm_up: 0.9999 } }, ["warm_up"]).probabilities, ["> 99 %"]);
  assert.deepEqual([line.hours, line.verdict], ["2.1", "ambiguous: thermal lag, warm up"]);
  assert.deepEqual([line.experiment, line.result], [`${ROUND.why}.`, ""]);
});

test("a choice and its result are two sentences, each with one full stop", () => {
  const line = lineOfRound({ ...ROUND, why: "the probability is > 99 %.", came_text: "expected: one cause" }, []);
  assert.deepEqual([line.experiment, line.result], ["The probability is > 99 %.", "Expected: one cause."]);
});

test("effects in a sentence are named as its columns name them; a command keeps their ids", () => {
  const line = lineOfRound(
    { ...ROUND, why: "if it is warm_up, add it by `labctl improve --add warm_up`", came_text: "" },
    [],
  );
  assert.equal(line.experiment, "If it is warm up, add it by `labctl improve --add warm_up`.");
});

test("what waits for a person is marked, and so is an end without a cause", () => {
  assert.equal(diagnosisState({ state: "awaiting_confirmation", outcome: null, begins_at: null }).kind, "warn");
  assert.equal(diagnosisState({ state: "measuring", outcome: null, begins_at: null }).kind, "");
  assert.equal(diagnosisState({ state: "done", outcome: "one_cause", begins_at: null }).kind, "good");
  assert.deepEqual(diagnosisState({ state: "done", outcome: "hours_spent", begins_at: null }), {
    text: "hours spent",
    kind: "warn",
  });
});

test("before the time that it begins at nothing is said to be measured", () => {
  const begins_at = "2026-11-29T22:00:00Z";
  const waits = { state: /** @type {const} */ ("measuring"), outcome: null, begins_at };
  assert.match(diagnosisState(waits, Date.parse(begins_at) - 1000).text, /^begins \w{3},? \d+ Nov/);
  assert.equal(diagnosisState(waits, Date.parse(begins_at) + 1000).text, "measuring");
  assert.equal(diagnosisState({ ...waits, outcome: "one_cause" }, 0).text, "one cause");
});
