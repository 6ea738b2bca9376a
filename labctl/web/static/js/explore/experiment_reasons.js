// What the reasons of several experiments have in common is said once; no DOM here.

/** Between the clauses of a reason. */
const BETWEEN = "; ";

/**
 * The clauses that every reason has, and what is left of each: "2 h; ordered by hour" and "3 h; ordered by hour" have
 * "ordered by hour" in common. A single reason has nothing in common with another.
 * @param {readonly string[]} reasons
 * @returns {{ common: string, own: string[] }} texts that end with a full stop, or are empty
 */
export function sharedReasons(reasons) {
  const clauses = reasons.map((reason) => reason.replace(/\.$/, "").split(BETWEEN));
  const [first = [], ...others] = clauses;
  const isShared = (/** @type {string} */ clause) => others.every((each) => each.includes(clause));
  const common = others.length ? first.filter(isShared) : [];
  return {
    common: sentence(common),
    own: clauses.map((each) => sentence(each.filter((clause) => !common.includes(clause)))),
  };
}

/** @param {readonly string[]} clauses */
const sentence = (clauses) => (clauses.length ? `${clauses.join(BETWEEN)}.` : "");
