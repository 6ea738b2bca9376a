// Requests that are under way: what a page that takes long waits for, and since when.

/** @typedef {{ what: string, since: number }} Pending */

/** @type {Set<Pending>} */
const pending = new Set();

/**
 * Keep a request in the list until it is answered.
 * @template Answer
 * @param {string} what such as "GET /api/units"
 * @param {Promise<Answer>} answer
 * @returns {Promise<Answer>}
 */
export async function tracked(what, answer) {
  const entry = { what, since: performance.now() };
  pending.add(entry);
  try {
    return await answer;
  } finally {
    pending.delete(entry);
  }
}

/**
 * What is waited for, the longest first, with the time so far, s.
 * @returns {{ what: string, waited_s: number }[]}
 */
export const waitedFor = () =>
  [...pending]
    .sort((a, b) => a.since - b.since)
    .map(({ what, since }) => ({ what, waited_s: (performance.now() - since) / 1000 }));
