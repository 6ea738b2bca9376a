// What is shown of the rounds of a diagnosis; no DOM here.

import { capitalised, idText, instant, inWords, probabilityText } from "../core/format.js";

/** @import { Diagnosis, DiagnosisRound } from "../../../types/api.js" */

/** Suspects that have a column, at most. */
const MAX_COLUMNS = 5;

/** @type {Record<string, string>} */
const STATES = {
  criticising: "judging the recordings",
  awaiting_confirmation: "waits for your confirmation",
  measuring: "measuring",
  stopped: "stopped",
  failed: "could not go on",
};
/** @type {Record<string, string>} */
const OUTCOMES = {
  one_cause: "one cause",
  several_causes: "several causes",
  adequate: "adequate",
  indistinguishable: "cannot be distinguished",
  hours_spent: "hours spent",
  unexplained: "unexplained",
  insufficient_data: "insufficient data",
  cannot_be_done: "cannot be done",
  ended_by_person: "ended",
};
const FOUND = ["one_cause", "several_causes", "adequate"];

/**
 * The state in words, and the kind of its chip. Nothing is measured before the time that it begins at.
 * @param {Pick<Diagnosis, "state" | "outcome" | "begins_at">} diagnosis
 * @param {number} [now_ms] by the clock of the browser
 * @returns {{ text: string, kind: "good" | "warn" | "" }}
 */
export function diagnosisState({ state, outcome, begins_at }, now_ms = Date.now()) {
  if (outcome) return { text: OUTCOMES[outcome] ?? outcome, kind: FOUND.includes(outcome) ? "good" : "warn" };
  if (state === "measuring" && begins_at && Date.parse(begins_at) > now_ms)
    return { text: `begins ${instant(begins_at)}`, kind: "" };
  return { text: STATES[state] ?? state, kind: state === "criticising" || state === "measuring" ? "" : "warn" };
}

/**
 * The effects that have a column: those that a verdict names, then the most probable in any round.
 * @param {readonly Pick<DiagnosisRound, "named" | "suspects">[]} rounds
 */
export function suspectColumns(rounds) {
  /** @type {Map<string, number>} */
  const highest = new Map();
  for (const { named, suspects } of rounds) {
    for (const effect of named) highest.set(effect, 1);
    for (const [effect, probability] of Object.entries(suspects))
      highest.set(effect, Math.max(probability, highest.get(effect) ?? 0));
  }
  return [...highest]
    .sort((one, other) => other[1] - one[1])
    .slice(0, MAX_COLUMNS)
    .map(([effect]) => effect);
}

/**
 * The ids of all effects that the rounds speak of.
 * @param {readonly Pick<DiagnosisRound, "named" | "suspects">[]} rounds
 */
export const effectsOfRounds = (rounds) =>
  rounds.flatMap(({ named, suspects }) => [...named, ...Object.keys(suspects)]);

/**
 * The cells of a round.
 * @param {Pick<DiagnosisRound, "spent_hours" | "verdict" | "named" | "suspects" | "why" | "came_text">} round
 * @param {readonly string[]} columns
 * @param {readonly string[]} [ids] of the effects that its texts name
 */
export function lineOfRound(round, columns, ids = effectsOfRounds([round])) {
  return {
    hours: round.spent_hours.toFixed(1),
    verdict: round.named.length ? `${round.verdict}: ${round.named.map(idText).join(", ")}` : round.verdict,
    probabilities: columns.map((effect) => {
      const probability = round.suspects[effect];
      return probability === undefined ? "–" : probabilityText(probability);
    }),
    experiment: sentence(inWords(round.why, ids)),
    result: sentence(inWords(round.came_text, ids)),
  };
}

/**
 * A text with a capital letter and one full stop; nothing stays nothing.
 * @param {string} text
 */
const sentence = (text) => (text ? `${capitalised(text).replace(/\.+$/, "")}.` : "");
