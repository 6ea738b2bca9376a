// Following the live calibration: reconnects after a break, until it has ended.

import { eventStream } from "../core/http/api.js";
import { isAbort, Problem } from "../core/http/errors.js";
import { untilVisible, whileVisible } from "../core/visible.js";

/** @import { LiveState } from "../../../types/api.js" */

const RETRY_DELAYS_MS = [1000, 2000, 4000, 8000, 15_000];

/** @param {LiveState} state */
export const goesOn = (state) => state.stage === "running" || state.stage === "storing";

/**
 * @param {(state: LiveState) => void} show
 * @param {(why: string) => void} trouble called with why nothing is heard, and with "" once it is heard again
 * @param {AbortSignal} signal
 */
export async function followLive(show, trouble, signal) {
  let tries = 0;
  while (!signal.aborted) {
    await untilVisible(signal);
    const seen = whileVisible(signal);
    try {
      for await (const { event, data } of eventStream("/api/live/events", { signal: seen })) {
        tries = 0;
        trouble("");
        if (event !== "state") continue;
        const state = /** @type {LiveState} */ (data);
        show(state);
        if (!goesOn(state)) return;
      }
    } catch (error) {
      if (signal.aborted) return;
      if (seen.aborted) continue; // the tab was hidden
      trouble(error instanceof Problem ? error.message : isAbort(error) ? "" : "the connection broke");
      if (error instanceof Problem && error.status < 500) return;
    }
    const delay = RETRY_DELAYS_MS[Math.min(tries++, RETRY_DELAYS_MS.length - 1)];
    await new Promise((resolve) => setTimeout(resolve, delay));
  }
}
