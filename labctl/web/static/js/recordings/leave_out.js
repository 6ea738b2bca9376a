// Which readings can be left out of a log by choice, and which of a recording were, in words.

import { count } from "../core/format.js";

/** @typedef {{ what: string, channel?: string, n?: number | null, may_leave_out?: boolean }} Found */
/** @typedef {{ what: string, channel?: string, n: number, of: number, why: string }} Left */

/**
 * One choice for each kind of finding whose readings can be left out, in the order found.
 * @param {readonly Found[]} warnings
 * @param {number} rows of the log
 * @returns {{ kind: string, text: string }[]}
 */
export function leaveOutChoices(warnings, rows) {
  const able = warnings.filter((each) => each.may_leave_out);
  const kinds = [...new Set(able.map((each) => each.what))];
  return kinds.map((kind) => {
    const parts = able
      .filter((each) => each.what === kind)
      .map(({ n, channel }) => `${count(n ?? 0)}${channel && channel !== "t_s" ? ` of ${channel}` : ""}`);
    return { kind, text: `${kind}: ${parts.join(", ")} (of ${count(rows)} readings)` };
  });
}

/**
 * Put a kind into the chosen ones, or take it out; whether the log has to be looked at anew.
 *
 * Rows that go back in time have no place in a recording: without them the other findings are others.
 * @param {Set<string>} chosen
 * @param {string} kind
 * @param {boolean} isChosen
 */
export function choose(chosen, kind, isChosen) {
  if (isChosen) chosen.add(kind);
  else chosen.delete(kind);
  return kind === "time_back";
}

/**
 * What was left out, as the command line says it.
 * @param {Left} left
 */
export const leftOutText = ({ n, of, channel, why }) =>
  `Left out: ${count(n)} of ${count(of)} readings${channel ? ` of ${channel}` : ""} (${why}).`;
