// Errors that pass by themselves: when to ask again for what the service could not answer.

import { Problem, Unreachable } from "./errors.js";

/** Statuses of a service that can answer later: too busy, its database out of reach, restarted behind a proxy. */
const PASSING = [429, 502, 503, 504];
/** A service that answered with such a status is not asked again sooner, nor much later, s. */
const [MIN_WAIT_S, MAX_WAIT_S] = [3, 30];

/**
 * How long to wait before the same is asked again, s; null: asking again does not help.
 * @param {unknown} error
 */
export function waitOf(error) {
  if (error instanceof Unreachable) return 0; // the next sign of life says that it answers
  if (!(error instanceof Problem) || !PASSING.includes(error.status)) return null;
  return Math.min(Math.max(error.retry_after_s, MIN_WAIT_S), MAX_WAIT_S);
}

/**
 * Call `again` at the first sign of life of the service after the wait; never where the error does not pass by itself.
 * @param {unknown} error
 * @param {AbortSignal} signal
 * @param {() => unknown} again
 */
export function whenItMayPass(error, signal, again) {
  const wait_s = waitOf(error);
  if (wait_s === null || signal.aborted) return;
  const listen = () => window.addEventListener("labctl:heard", again, { signal, once: true });
  if (wait_s === 0) return listen();
  const waiting = setTimeout(listen, 1000 * wait_s);
  signal.addEventListener("abort", () => clearTimeout(waiting), { once: true });
}
