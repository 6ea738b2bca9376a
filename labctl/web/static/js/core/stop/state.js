// When a page says that the bench is not stopped, and in which words.

/** A stop that is not confirmed after so long is said to have failed, ms. */
export const LATE_MS = 3000;

/**
 * What is known of the stops of a bench.
 * @typedef {object} Known
 * @property {number | null} asked_ms time since this page asked for a stop that is not confirmed; null: it did not
 * @property {string} trouble why the last request for a stop failed, or ""
 * @property {string} reported what the service reports of a stop that is late, or ""
 */

/**
 * What is shown over the page; null for nothing.
 * @param {Known} known
 * @returns {{ title: string, text: string } | null}
 */
export function notStopped({ asked_ms, trouble, reported }) {
  const title = "NOT STOPPED. Use the stop switch.";
  if (asked_ms !== null && trouble) return { title, text: trouble };
  if (asked_ms !== null && asked_ms > LATE_MS)
    return { title, text: reported || "It is not confirmed that the table stands. The stop is requested again." };
  return reported ? { title, text: reported } : null;
}

/**
 * Whether an answer to a stop confirms that the table stands: from the service a campaign that has ended, from the page
 * in place of the service `stands`.
 * @param {{ ended?: boolean, stands?: boolean }} answer
 */
export const confirms = (answer) => answer.stands === true || answer.ended === true;
