// When a page says that the bench is not stopped, and in which words.

/** A stop that is not confirmed after so long is said to have failed, ms. */
export const LATE_MS = 3000;
/** A stop that is older is not asked for again by a page that is loaded: a person may have let the bench move since. */
const REMEMBERED_MS = 10 * 60_000;
const TITLE = "NOT STOPPED. Use the stop switch.";
const AGAIN = "The stop is requested again every second.";

/**
 * What is known of the stops of a bench.
 * @typedef {object} Known
 * @property {number | null} asked_ms time since this page asked for a stop that is not confirmed; null: it did not
 * @property {boolean} shown whether it was said of this stop already that the bench is not stopped
 * @property {string} trouble why the last request for a stop failed, or ""
 * @property {string} reported what the service reports of a stop that is late, or ""
 * @property {string} left what the safe state could not confirm of the table after the campaign had ended, or ""
 */

/**
 * What is shown over the page; null for nothing. Once it is shown of a stop, it is shown until that is confirmed.
 * @param {Known} known
 * @returns {{ title: string, text: string } | null}
 */
export function notStopped({ asked_ms, shown, trouble, reported, left }) {
  if (left) return { title: TITLE, text: `The campaign has ended. It is not known whether the table stands: ${left}` };
  const asked = asked_ms !== null && (shown || trouble !== "" || asked_ms > LATE_MS);
  if (!asked && !reported) return null;
  return { title: TITLE, text: reported || trouble || `It is not confirmed that the table stands. ${AGAIN}` };
}

/**
 * Whether an answer to a stop confirms that the table stands: from the service a campaign that has ended, from the page
 * in place of the service `stands`.
 * @param {{ ended?: boolean, stands?: boolean }} answer
 */
export const confirms = (answer) => answer.stands === true || answer.ended === true;

/** Parts of the safe state that say nothing of the table, as the service names them. */
const OTHER_PARTS = /^(chamber to its safe set point|stream of [^:]+ closed): /;

/**
 * Whether what a safe state could not confirm leaves open whether the table stands.
 * @param {{ unconfirmed?: string, confirmed_at?: string | null }} bench
 */
export const tableUnknown = ({ unconfirmed = "", confirmed_at = null }) =>
  unconfirmed !== "" && confirmed_at === null && !unconfirmed.split("; ").every((part) => OTHER_PARTS.test(part));

/**
 * Why a request for a stop failed, for a person at a table.
 * @param {{ status?: number, detail: string }} failure the status of the answer, where there was one that could be read
 */
export function troubleOf({ status, detail }) {
  if (status === undefined) return `labctl does not answer. ${AGAIN}`;
  if (status === 401 || status === 403) return `labctl refuses the stop: ${detail}`;
  // a process of labctl says itself what a person has to do
  const said = detail.replace(/^NOT STOPPED: /, "").replace(/ Use the stop switch of the bench\.$/, "");
  return `labctl answers: ${said.replace(/\.?$/, ".")} ${AGAIN}`;
}

/**
 * The stop that a page had asked for when it was left or loaded again, from what was stored; null for none.
 * @param {string | null} stored
 * @param {number} now_ms milliseconds since 1970
 * @returns {{ campaign: number, body: { by?: string, reason: string }, at_ms: number } | null}
 */
export function remembered(stored, now_ms) {
  const stop = stored === null ? null : JSON.parse(stored);
  return stop !== null && now_ms - stop.at_ms < REMEMBERED_MS ? stop : null;
}
