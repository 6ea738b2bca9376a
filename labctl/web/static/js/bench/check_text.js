// A check of the bench in words.

/** @import { BenchCheck } from "../../../types/api.js" */

/** @type {Record<"good" | "doubtful" | "bad", string>} */
export const STATE_WORDS = { good: "in order", doubtful: "doubtful", bad: "wrong" };
/** @type {Record<"good" | "doubtful" | "bad", string>} */
export const STATE_KINDS = { good: "good", doubtful: "warn", bad: "bad" };

/**
 * How many things are wrong or doubtful, of all instruments.
 * @param {Pick<BenchCheck, "devices">} check
 */
export function summaryOf(check) {
  const findings = check.devices.flatMap((device) => device.findings);
  const [wrong, doubtful] = ["bad", "doubtful"].map((state) => findings.filter((each) => each.state === state).length);
  const n = check.devices.length;
  const instruments = n === 1 ? "1 instrument" : `${n} instruments`;
  if (!wrong && !doubtful) return `${instruments}, nothing is wrong.`;
  return `${instruments}: ${wrong} wrong, ${doubtful} doubtful.`;
}
