// The sentences of a verdict in the order of a page: what makes it void and the verdict first, then doubts of the data.

/** @import { Criticism } from "../../../types/api.js" */

/**
 * The answer begins with the warnings of the data. A verdict on data that are certainly wrong means nothing, so these
 * stay before it; what is only to be checked follows it.
 * @param {Pick<Criticism, "text" | "warnings">} criticism
 * @param {ReadonlySet<string>} [without] lines that stand elsewhere
 */
export function verdictLines({ text, warnings }, without = new Set()) {
  const said = text.slice(0, warnings.length);
  const [verdict, ...others] = text.slice(warnings.length).filter((line) => !without.has(line));
  const isCertain = (/** @type {string} */ _, /** @type {number} */ k) => warnings[k].severity === "certain";
  return {
    first: [...said.filter(isCertain), verdict],
    doubts: said.filter((line, k) => !isCertain(line, k)),
    others,
  };
}
